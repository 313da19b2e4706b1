/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/sensor.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "base/pixels.h"
#include "bench/random.h"

namespace codedexposure
{

namespace
{

/* Noise is drawn for blocks of a row's pixels, so that the loops vectorise; one
 * draw of four words serves two pixels, half a block apart. */
constexpr int kDraws = 32;
constexpr int kBlock = 2 * kDraws;
using Lanes = std::array<float, kBlock>;

/* Below this mean, Poisson numbers are drawn by inversion; above, the error of
 * the expansion is less than 5e-5. */
constexpr float kExactBelow = 16.0f;

/* Words of the counter: draw, purpose, frame. */
enum Purpose : std::uint32_t { kNormal, kFewElectrons };

struct NoiseKey {
  std::uint64_t seed;
  std::uint64_t frame;

  Philox::Words draw (std::uint32_t index, Purpose purpose) const
  {
    return Philox::draw (
        {index, purpose, std::uint32_t (frame), std::uint32_t (frame >> 32)},
        {std::uint32_t (seed), std::uint32_t (seed >> 32)});
  }
};

/* Natural logarithm of a normal x > 0, to 1e-7: x = 2^e m with m around 1, and
 * the series of the inverse hyperbolic tangent. */
inline float
log_of (float x)
{
  const std::int32_t bits = std::bit_cast<std::int32_t> (x);
  const std::int32_t sqrt_half = 0x3f3504f3;
  const std::int32_t exponent = (bits - sqrt_half) >> 23;
  const float m = std::bit_cast<float> (bits - (exponent << 23));
  const float t = (m - 1.0f) / (m + 1.0f);
  const float t2 = t * t;
  const float series =
      1.0f + t2 * (1.0f / 3 + t2 * (1.0f / 5 + t2 * (1.0f / 7)));
  return float (exponent) * std::numbers::ln2_v<float> + 2.0f * t * series;
}

/* Two independent standard normal numbers by the polar method: a radius from
 * @u, an angle in the first quadrant and two signs from @v. */
inline void
normal_pair (std::uint32_t u, std::uint32_t v, float &a, float &b)
{
  const float uniform = float (std::int32_t (u >> 1)) * 0x1p-31f + 0x1p-32f;
  const float radius = std::sqrt (-2.0f * std::min (log_of (uniform), 0.0f));

  /* Angle off 45 degrees, in -pi/4..pi/4. */
  const float angle = (float (std::int32_t (v & 0xffffff)) - 0x7fffff.8p0f) *
                      (std::numbers::pi_v<float> * 0x1p-25f);
  const float x2 = angle * angle;
  const float sine =
      angle * (1.0f - x2 * (1.0f / 6 - x2 * (1.0f / 120 - x2 * (1.0f / 5040))));
  const float cosine =
      1.0f -
      x2 * (0.5f - x2 * (1.0f / 24 - x2 * (1.0f / 720 - x2 * (1.0f / 40320))));
  const float half = radius * (std::numbers::sqrt2_v<float> / 2);
  const float sign_a = float (std::int32_t ((v >> 30) & 2) - 1);
  const float sign_b = float (std::int32_t ((v >> 29) & 2) - 1);
  a = sign_a * half * (cosine + sine);
  b = sign_b * half * (cosine - sine);
}

void
draw_normals (const NoiseKey &key, std::uint32_t block, Lanes &a, Lanes &b)
{
  std::array<std::array<std::uint32_t, kDraws>, 4> words;
  for (std::uint32_t i = 0; i < kDraws; i++) {
    const Philox::Words drawn = key.draw (block * kDraws + i, kNormal);
    for (std::size_t w = 0; w < 4; w++)
      words[w][i] = drawn[w];
  }
  for (std::size_t i = 0; i < kDraws; i++)
    normal_pair (words[0][i], words[1][i], a[i], b[i]);
  for (std::size_t i = 0; i < kDraws; i++)
    normal_pair (words[2][i], words[3][i], a[kDraws + i], b[kDraws + i]);
}

/* e^-x for 0 <= x < 16, to 1e-9: a series at x / 64, squared six times. */
inline double
decay_of (double x)
{
  const double s = -x / 64;
  double series = 1.0;
  for (int i = 8; i >= 1; i--)
    series = 1.0 + s * series / i;
  for (int i = 0; i < 6; i++)
    series *= series;
  return series;
}

/* Poisson numbers where the mean is below kExactBelow, others untouched:
 * inversion of the distribution, term by term, for all lanes at a time. */
void
draw_few (
    const NoiseKey &key, std::uint32_t block, const Lanes &means, Lanes &drawn)
{
  std::array<double, kBlock> uniform, mean, probability, below;
  std::array<std::uint64_t, kBlock> count = {};
  const auto fraction = [] (std::uint32_t high, std::uint32_t low) {
    return (high * 0x1p20 + (low >> 12) + 0.5) * 0x1p-52;
  };
  for (std::uint32_t i = 0; i < kDraws; i++) {
    const Philox::Words words = key.draw (block * kDraws + i, kFewElectrons);
    uniform[i] = fraction (words[0], words[1]);
    uniform[kDraws + i] = fraction (words[2], words[3]);
  }
  for (std::size_t i = 0; i < kBlock; i++) {
    mean[i] = means[i] < kExactBelow ? means[i] : 0.0f;
    probability[i] = below[i] = decay_of (mean[i]);
  }
  /* The bound has negligible probability; it ends searches that rounding keeps
   * open. */
  std::uint64_t searching = 1;
  for (int k = 1; searching != 0 && k < 100; k++) {
    searching = 0;
    for (std::size_t i = 0; i < kBlock; i++) {
      /* The sign of a difference; a comparison would not vectorise. */
      const std::uint64_t more =
          std::bit_cast<std::uint64_t> (below[i] - uniform[i]) >> 63;
      count[i] += more;
      probability[i] *= mean[i] * (1.0 / k);
      below[i] += probability[i];
      searching |= more;
    }
  }
  for (std::size_t i = 0; i < kBlock; i++)
    drawn[i] = means[i] < kExactBelow ? float (count[i]) : drawn[i];
}

/*
 * Poisson numbers from normal ones, @z, where the mean is kExactBelow or more;
 * others become 0. The quantile of the one distribution is that of the other,
 * corrected to third order (Giles, "Algorithm 955: approximation of the inverse
 * Poisson cumulative distribution function", ACM TOMS 2016).
 */
void
draw_many (const Lanes &means, const Lanes &z, Lanes &drawn)
{
  for (std::size_t i = 0; i < kBlock; i++) {
    const float mean = std::max (means[i], kExactBelow);
    const float root = std::sqrt (mean);
    const float w = z[i];
    const float w2 = w * w;
    const float first = (2.0f + w2) * (1.0f / 6);
    const float second = -w * (2.0f + w2) * (1.0f / 72);
    const float third = w2 * (7.0f / 810 + w2 * (1.0f / 270)) - 8.0f / 405;
    const float quantile =
        mean + root * w + first + second / root + third / mean;
    const float whole = float (std::int32_t (std::max (quantile, 0.0f)));
    drawn[i] = means[i] < kExactBelow ? 0.0f : whole;
  }
}

Lanes
draw_electrons (const NoiseKey &key, std::uint32_t block, const Lanes &means,
    const Lanes &z)
{
  Lanes drawn;
  draw_many (means, z, drawn);
  const auto few = [] (float mean) {
    return mean > 0.0f && mean < kExactBelow;
  };
  if (std::any_of (means.begin (), means.end (), few))
    draw_few (key, block, means, drawn);
  return drawn;
}

/* @number bent by a parabola that is 0 at 0 and at @range. */
inline float
bent (float number, float bow, float range)
{
  return number + 4.0f * bow * number * (1.0f - number / range);
}

/* Half up, then clamped; the sum is never negative, so truncation is floor. */
template <typename Pixel>
Pixel
quantise (float number, float largest)
{
  return Pixel (
      std::int32_t (std::min (std::max (number, 0.0f) + 0.5f, largest)));
}

} // namespace

template <typename Pixel>
void
Sensor::read_out (ImageView<const float> light, double unit,
    std::uint64_t frame, ImageView<Pixel> out) const
{
  const float largest = float (largest_pixel (bits));
  const float black = float (black_level);

  if (full_well <= 0.0) {
    /* A division, because the error of a rounded factor could change how a
     * value halfway between two numbers is rounded. */
    const float divisor = float (unit / (gain * largest));
    for (int y = 0; y < out.height; y++)
      std::transform (
          light.row (y), light.row (y) + out.width, out.row (y), [=] (float l) {
            return quantise<Pixel> (l / divisor + black, largest);
          });
    return;
  }

  const NoiseKey key = {seed, frame};
  const float most = float (well > 0.0 ? well : full_well);
  const float to_electrons = float (full_well / unit);
  const float to_number = float (gain * largest / full_well);
  const float noise = float (read_noise);
  const int blocks = (out.width + kBlock - 1) / kBlock;
  for (int y = 0; y < out.height; y++)
    for (int b = 0; b < blocks; b++) {
      const int x = b * kBlock;
      const std::size_t count = std::size_t (std::min (kBlock, out.width - x));
      const float *in = light.row (y) + x;
      Pixel *numbers = out.row (y) + x;
      const auto block = std::uint32_t (y * blocks + b);

      Lanes means = {}, shot, read;
      for (std::size_t i = 0; i < count; i++)
        means[i] = in[i] * to_electrons;
      draw_normals (key, block, shot, read);
      const Lanes electrons = draw_electrons (key, block, means, shot);
      Lanes amplified = {};
      for (std::size_t i = 0; i < count; i++)
        amplified[i] =
            (std::min (electrons[i], most) + noise * read[i]) * to_number;
      if (bow != 0.0)
        for (std::size_t i = 0; i < count; i++)
          amplified[i] = bent (amplified[i], float (bow), largest - black);
      for (std::size_t i = 0; i < count; i++)
        numbers[i] = quantise<Pixel> (amplified[i] + black, largest);
    }
}

template void Sensor::read_out (ImageView<const float>, double, std::uint64_t,
    ImageView<std::uint8_t>) const;
template void Sensor::read_out (ImageView<const float>, double, std::uint64_t,
    ImageView<std::uint16_t>) const;

} // namespace codedexposure

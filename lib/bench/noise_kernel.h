/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The noise of a block of pixels; see base/vector.h for what it may call. The
 * loops over a block become vectors. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>

#include "base/vector.h"
#include "bench/kernels.h"
#include "bench/random.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

using bench::kBlock;
using bench::kDraws;

struct Lanes {
  float of[kBlock];
};

/* Below this mean, Poisson numbers are drawn by inversion; above, the error of
 * the expansion is less than 5e-5. */
constexpr float kExactBelow = 16.0f;

/* Words of the counter: draw, purpose, frame. */
enum Purpose : std::uint32_t { kNormal, kFewElectrons };

/* Lanes of 64 bits, of which the lower halves count. */
using Words = Vector<std::uint64_t>;

CODEDEXPOSURE_INLINE Words
product_of (Words a, Words b)
{
#if CODEDEXPOSURE_VECTOR_BYTES == 64
  return Words (
      _mm512_maskz_mul_epu32 (__mmask8 (-1), __m512i (a), __m512i (b)));
#elif CODEDEXPOSURE_VECTOR_BYTES == 32
  return Words (_mm256_mul_epu32 (__m256i (a), __m256i (b)));
#elif defined __SSE2__
  return Words (_mm_mul_epu32 (__m128i (a), __m128i (b)));
#else
  return (a & 0xffffffffu) * (b & 0xffffffffu);
#endif
}

struct Draws {
  std::uint32_t word[4][kDraws];
};

/* Philox::draw () of all counters of a block. */
CODEDEXPOSURE_INLINE void
draw (const bench::Exposed &exposed, Purpose purpose, Draws &to)
{
  constexpr int kSome = kLanes<std::uint64_t>;
  typedef std::uint32_t Halves __attribute__ ((vector_size (4 * kSome)));
  for (int i = 0; i < kDraws; i += kSome) {
    Words a, b = Words{} + std::uint64_t (purpose), c = Words{} + exposed.frame,
             d = Words{} + (exposed.frame >> 32);
    for (int lane = 0; lane < kSome; lane++)
      a[lane] = exposed.block * kDraws + std::uint32_t (i + lane);
    std::uint32_t key = std::uint32_t (exposed.seed),
                  other = std::uint32_t (exposed.seed >> 32);
    for (int round = 0; round < Philox::kRounds; round++) {
      const Words first = product_of (a, Words{} + Philox::kFirst);
      const Words second = product_of (c, Words{} + Philox::kSecond);
      a = (second >> 32) ^ b ^ key;
      b = second;
      c = (first >> 32) ^ d ^ other;
      d = first;
      key += Philox::kFirstStep;
      other += Philox::kSecondStep;
    }
    const Words all[] = {a, b, c, d};
    for (int w = 0; w < 4; w++) {
      const Halves words = __builtin_convertvector(all[w], Halves);
      __builtin_memcpy (to.word[w] + i, &words, sizeof words);
    }
  }
}

/* Natural logarithm of a normal x > 0, to 1e-7: x = 2^e m with m around 1, and
 * the series of the inverse hyperbolic tangent. */
CODEDEXPOSURE_INLINE float
log_of (float x)
{
  const std::int32_t bits = __builtin_bit_cast(std::int32_t, x);
  const std::int32_t sqrt_half = 0x3f3504f3;
  const std::int32_t exponent = (bits - sqrt_half) >> 23;
  const float m = __builtin_bit_cast(float, bits - (exponent << 23));
  const float t = (m - 1.0f) / (m + 1.0f);
  const float t2 = t * t;
  const float series =
      1.0f + t2 * (1.0f / 3 + t2 * (1.0f / 5 + t2 * (1.0f / 7)));
  return float (exponent) * std::numbers::ln2_v<float> + 2.0f * t * series;
}

/* Two independent standard normal numbers by the polar method: a radius from
 * @p u, an angle in the first quadrant and two signs from @p v. */
CODEDEXPOSURE_INLINE void
normal_pair (std::uint32_t u, std::uint32_t v, float &a, float &b)
{
  const float uniform = float (std::int32_t (u >> 1)) * 0x1p-31f + 0x1p-32f;
  const float log = log_of (uniform);
  const float radius = __builtin_sqrtf (-2.0f * (log > 0.0f ? 0.0f : log));

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

inline void
draw_normals (const bench::Exposed &exposed, Lanes &a, Lanes &b)
{
  Draws drawn;
  draw (exposed, kNormal, drawn);
  for (int half = 0; half < 2; half++)
    for (int i = 0; i < kDraws; i++)
      normal_pair (drawn.word[2 * half][i], drawn.word[2 * half + 1][i],
          a.of[half * kDraws + i], b.of[half * kDraws + i]);
}

/* e^-x for 0 <= x < 16, to 1e-9: a series at x / 64, squared six times. */
CODEDEXPOSURE_INLINE double
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

CODEDEXPOSURE_INLINE double
fraction_of (std::uint32_t high, std::uint32_t low)
{
  return (high * 0x1p20 + (low >> 12) + 0.5) * 0x1p-52;
}

/* Poisson numbers where the mean is below kExactBelow, others untouched:
 * inversion of the distribution, term by term, for all lanes at a time. */
inline void
draw_few (const bench::Exposed &exposed, const Lanes &means, Lanes &drawn)
{
  double uniform[kBlock], mean[kBlock], probability[kBlock], below[kBlock];
  std::uint64_t count[kBlock] = {};
  Draws words;
  draw (exposed, kFewElectrons, words);
  for (int i = 0; i < kDraws; i++) {
    uniform[i] = fraction_of (words.word[0][i], words.word[1][i]);
    uniform[kDraws + i] = fraction_of (words.word[2][i], words.word[3][i]);
  }
  for (int i = 0; i < kBlock; i++) {
    mean[i] = means.of[i] < kExactBelow ? means.of[i] : 0.0f;
    probability[i] = below[i] = decay_of (mean[i]);
  }
  /* The bound has negligible probability; it ends searches that rounding keeps
   * open. */
  std::uint64_t searching = 1;
  for (int k = 1; searching != 0 && k < 100; k++) {
    searching = 0;
    for (int i = 0; i < kBlock; i++) {
      /* The sign of a difference; a comparison would not vectorise. */
      const std::uint64_t more =
          __builtin_bit_cast(std::uint64_t, below[i] - uniform[i]) >> 63;
      count[i] += more;
      probability[i] *= mean[i] * (1.0 / k);
      below[i] += probability[i];
      searching |= more;
    }
  }
  for (int i = 0; i < kBlock; i++)
    drawn.of[i] = means.of[i] < kExactBelow ? float (count[i]) : drawn.of[i];
}

/*
 * Poisson numbers from normal ones, @p z, where the mean is kExactBelow or
 * more; others become 0. The quantile of the one distribution is that of the
 * other, corrected to third order (Giles, "Algorithm 955: approximation of the
 * inverse Poisson cumulative distribution function", ACM TOMS 2016).
 */
inline void
draw_many (const Lanes &means, const Lanes &z, Lanes &drawn)
{
  /* Apart, as the compiler makes no vectors of a loop with both conversions. */
  std::int32_t whole[kBlock];
  for (int i = 0; i < kBlock; i++) {
    const float mean = means.of[i] < kExactBelow ? kExactBelow : means.of[i];
    const float root = __builtin_sqrtf (mean);
    const float w = z.of[i];
    const float w2 = w * w;
    const float first = (2.0f + w2) * (1.0f / 6);
    const float second = -w * (2.0f + w2) * (1.0f / 72);
    const float third = w2 * (7.0f / 810 + w2 * (1.0f / 270)) - 8.0f / 405;
    const float quantile =
        mean + root * w + first + second / root + third / mean;
    whole[i] = std::int32_t (quantile < 0.0f ? 0.0f : quantile);
  }
  for (int i = 0; i < kBlock; i++)
    drawn.of[i] = means.of[i] < kExactBelow ? 0.0f : float (whole[i]);
}

/** Kernels::expose. */
inline void
expose (const bench::Exposed &exposed, const float *light, float *numbers)
{
  Lanes means, shot, read, electrons;
  for (int i = 0; i < kBlock; i++)
    means.of[i] = light[i] * exposed.to_electrons;
  draw_normals (exposed, shot, read);
  draw_many (means, shot, electrons);
  int has_few = 0;
  for (int i = 0; i < kBlock; i++)
    has_few |= (means.of[i] > 0.0f) & (means.of[i] < kExactBelow);
  if (has_few)
    draw_few (exposed, means, electrons);
  for (int i = 0; i < kBlock; i++) {
    const float held =
        exposed.most < electrons.of[i] ? exposed.most : electrons.of[i];
    numbers[i] = (held + exposed.read_noise * read.of[i]) * exposed.to_number;
  }
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

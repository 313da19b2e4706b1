/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/statistics.h"
#include "doctor/defects.h"
#include "doctor/statistics.h"

namespace codedexposure
{

namespace
{

/* Below this variance over time, DN squared, rounding hides the noise. */
constexpr double kQuiet = 0.15;
/* Light that falls below this part within so many pixels ends there. */
constexpr float kEnds = 0.6f;
constexpr int kReach = 24;
/* Pixels of a block whose means are compared. */
constexpr int kBlock = 4;
/* Readings. */
constexpr const char *kNeighbours = "noise that neighbours share";
constexpr const char *kOverTime = "noise shared with the frame before";

/* By how much less light than the brightest one the darkest of each 2x2 pixels
 * has, as a part. */
double
mosaic_of (const Image<float> &light)
{
  std::array<std::array<double, 2>, 2> sums = {};
  each_pixel (light, [&] (int x, int y) {
    sums[std::size_t (y % 2)][std::size_t (x % 2)] += double (light.at (x, y));
  });
  const auto [low, high] =
      std::minmax ({sums[0][0], sums[0][1], sums[1][0], sums[1][1]});
  return 1.0 - low / std::max (high, 1.0);
}

/** Of the noise of pixels: with the next one in x, in y, and in time. */
struct Correlations {
  double across = 0.0, down = 0.0, over_time = 0.0;
  double variance = 0.0; ///< DN squared
  double values = 0.0;   ///< that they are of
};

/** The middle of @p image, a million pixels at most. */
template <typename Pixel>
Image<Pixel>
middle_of (const Image<Pixel> &image)
{
  constexpr int kMost = 1024;
  const int width = std::min (kMost, image.width ());
  const int height = std::min (kMost, image.height ());
  const int left = (image.width () - width) / 2;
  const int top = (image.height () - height) / 2;
  Image<Pixel> middle (width, height);
  each_pixel (middle,
      [&] (int x, int y) { middle.at (x, y) = image.at (left + x, top + y); });
  return middle;
}

/* Only of what all pixels do not have in common. Pixels at the ends of the
 * range are cut. */
Correlations
correlations_of (const std::vector<Image<std::uint16_t>> &frames,
    const Stack &stack, const Image<float> &whole_dark)
{
  const Image<float> mean = middle_of (stack.mean);
  const Image<float> dark = middle_of (whole_dark);
  const Image<std::uint8_t> zeros = middle_of (stack.zeros);
  const Image<std::uint8_t> full = middle_of (stack.full);
  const int width = mean.width (), height = mean.height ();
  const double middle = mean_of (mean.view ());
  const double light = std::max (1.0, middle - mean_of (dark.view ()));
  Image<float> rest (width, height), before;
  double across = 0.0, down = 0.0, time = 0.0, squares = 0.0, pixels = 0.0;
  for (const Image<std::uint16_t> &frame : frames) {
    const double more = mean_of (frame.view ()) - middle;
    each_pixel (rest, [&] (int x, int y) {
      const bool cut = zeros.at (x, y) > 0 || full.at (x, y) > 0;
      const double part = double (mean.at (x, y) - dark.at (x, y)) / light;
      rest.at (x, y) =
          cut ? 0.0f : float (frame.at (x, y) - more * part) - mean.at (x, y);
    });
    each_pixel (rest, [&] (int x, int y) {
      const double own = double (rest.at (x, y));
      squares += own * own;
      pixels += own != 0.0;
      if (x + 1 < width)
        across += own * double (rest.at (x + 1, y));
      if (y + 1 < height)
        down += own * double (rest.at (x, y + 1));
      if (before.width () > 0)
        time += own * double (before.at (x, y));
    });
    before = rest;
  }
  const double count = double (frames.size ());
  squares = std::max (squares, 1e-9);
  /* What remains of a mean of few frames is correlated by itself. */
  return {across / squares, down / squares,
      time / squares * count / (count - 1.0) + 1.0 / (count - 1.0),
      squares / std::max (1.0, pixels) * count / (count - 1.0), pixels};
}

/* Noise that rounding hides says nothing. */
void
judge_noise (const Correlations &noise, Finding &finding)
{
  const double error = 100.0 / std::sqrt (std::max (1.0, noise.values));
  const auto measured = [&] (double part) {
    return noise.variance < kQuiet ? kNotMeasured
                                   : Measured{100.0 * part, error};
  };
  const double most = std::abs (noise.across) > std::abs (noise.down)
                          ? noise.across
                          : noise.down;
  const Measured beside = measured (most), before = measured (noise.over_time);
  finding.add (kNeighbours, beside);
  finding.add (kOverTime, before);
  const bool spaced = verdict_of (kNeighbours, beside) == Verdict::fail;
  const bool timed = verdict_of (kOverTime, before) == Verdict::fail;
  const auto share = [] (const Measured &number) {
    return " (correlation " + fixed (number.value, 0) + " %)";
  };
  if (spaced && most > 0.0)
    finding.blame ("noise-reduction",
        "neighbouring pixels share noise: the camera mixes them" +
            share (beside));
  else if (spaced)
    finding.blame ("sharpening",
        "the noise of neighbouring pixels has opposite signs: the camera makes "
        "them differ more" +
            share (beside));
  else if (timed)
    finding.blame ("noise-reduction",
        "frames share noise with those before: the camera mixes them" +
            share (before));
}

/* The @p good pixels that are not near a spot of others: light around dust
 * falls off. Where little remains, it is no dust that is everywhere. */
Image<std::uint8_t>
away_from_spots (ImageView<const std::uint8_t> good)
{
  constexpr int kNear = 6;
  constexpr double kEnough = 0.3;
  Image<std::uint8_t> all (good.width, good.height), away = all;
  double before = 0.0, after = 0.0;
  each_pixel (all, [&] (int x, int y) {
    all.at (x, y) = away.at (x, y) = good.at (x, y);
    before += good.at (x, y) != 0;
  });
  each_pixel (all, [&] (int x, int y) {
    bool spot = true, border = false;
    each_near (
        all, {x, y}, 1, [&] (int i, int j) { spot &= all.at (i, j) == 0; });
    if (!spot)
      return;
    each_near (
        all, {x, y}, 2, [&] (int i, int j) { border |= all.at (i, j) != 0; });
    if (border)
      each_near (
          away, {x, y}, kNear, [&] (int i, int j) { away.at (i, j) = 0; });
  });
  each_pixel (away, [&] (int x, int y) { after += away.at (x, y) != 0; });
  return after > kEnough * before ? std::move (away) : std::move (all);
}

/* What neighbours two pixels apart have in common beyond the light around them,
 * as a part of the light: no noise, and not the pixels' own sensitivity. */
double
texture_of (const Image<float> &whole, ImageView<const std::uint8_t> defects)
{
  const int width = whole.width (), height = whole.height ();
  const Image<std::uint8_t> seen = away_from_spots (defects);
  const auto good = std::as_const (seen).view ();
  const Image<float> around = smooth (whole);
  /* Where the light ends nearby, what is even is not known. */
  const auto ends = [&] (int x, int y) {
    float least = around.at (x, y);
    for (const int i : {-kReach, kReach})
      for (const int j : {-kReach, kReach})
        least = std::min (least, around.at (std::clamp (x + i, 0, width - 1),
                                     std::clamp (y + j, 0, height - 1)));
    return least < kEnds * around.at (x, y);
  };
  const Image<float> light = flattened (whole, good);
  const Image<float> even = smooth (light, good);
  Image<float> rest (width, height);
  each_pixel (rest, [&] (int x, int y) {
    if (good.at (x, y) != 0 && !ends (x, y))
      rest.at (x, y) = light.at (x, y) / even.at (x, y) - 1.0f;
  });
  double common = 0.0, count = 0.0;
  for (int y = 0; y + 2 < height; y++)
    for (int x = 0; x + 2 < width; x++) {
      const double own = double (rest.at (x, y));
      common += 0.5 * own * double (rest.at (x + 2, y) + rest.at (x, y + 2));
      count += own != 0.0;
    }
  return std::sqrt (std::max (0.0, common / std::max (1.0, count)));
}

} // namespace

Measured
change_between (const FrameMean &a, const FrameMean &b, const Stack &noise,
    const Image<float> &dark)
{
  const int width = a.picture.width / kBlock;
  const int height = a.picture.height / kBlock;
  const double black = mean_of (dark.view ());
  const double light_a = std::max (1.0, mean_of (a.picture) - black);
  const double light_b = std::max (1.0, mean_of (b.picture) - black);
  const double parts = 1.0 / a.frames + 1.0 / b.frames;
  double squares = 0.0, expected = 0.0, blocks = 0.0;
  for (int j = 0; j < height; j++)
    for (int i = 0; i < width; i++) {
      double step = 0.0, variance = 0.0;
      bool cut = false;
      for (int y = j * kBlock; y < (j + 1) * kBlock; y++)
        for (int x = i * kBlock; x < (i + 1) * kBlock; x++) {
          const double own = double (dark.at (x, y));
          step += (double (a.picture.at (x, y)) - own) * light_b / light_a -
                  (double (b.picture.at (x, y)) - own);
          /* Rounding alone has a variance, too. */
          variance +=
              parts * std::max (1.0 / 12.0, double (noise.variance.at (x, y)));
          cut |= noise.full.at (x, y) > 0;
        }
      if (cut)
        continue;
      squares += step * step;
      expected += variance;
      blocks++;
    }
  if (blocks < 2.0)
    return kNotMeasured;
  return {squares / expected, std::sqrt (2.0 / blocks)};
}

void
PictureCheck::add (const SeenFrame &frame)
{
  const bool late = int (middles_.size ()) >= frames_ / 2;
  Image<float> &half = halves_[late ? 1 : 0];
  if (half.width () == 0)
    half = Image<float> (frame.picture.width (), frame.picture.height ());
  each_pixel (half, [&] (int x, int y) {
    half.at (x, y) += float (frame.picture.at (x, y));
  });
  middles_.push_back (middle_of (frame.picture));
}

void
PictureCheck::judge (
    const Stack &all, const Image<float> &dark, int largest, Finding &finding)
{
  const int first = std::min (all.frames, frames_ / 2);
  const int second = all.frames - first;
  finding.measure ("light that one of 2x2 pixels lacks",
      {100.0 * mosaic_of (difference (all.mean, dark)), 0.0});
  Measured change = kNotMeasured;
  if (second > 0) {
    const auto mean = [&] (Image<float> &half, int frames) {
      each_pixel (
          half, [&] (int x, int y) { half.at (x, y) /= float (frames); });
      return FrameMean{std::as_const (half).view (), frames};
    };
    change = change_between (
        mean (halves_[0], first), mean (halves_[1], second), all, dark);
  }
  halves_ = {};
  finding.measure (kChange, change);
  // A picture that is not even and moves a little looks like noise.
  if (!finding.is_ill ())
    finding.measure ("texture",
        {100.0 * texture_of (difference (all.mean, dark),
                     find_defects (dark, all.mean, largest).good.view ()),
            0.1});
  if (!finding.is_ill ())
    judge_noise (correlations_of (middles_, all, dark), finding);
}

} // namespace codedexposure

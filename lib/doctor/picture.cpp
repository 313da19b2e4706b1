/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/statistics.h"
#include "doctor/defects.h"
#include "doctor/field.h"

namespace codedexposure
{

namespace
{

/* Below this variance over time, DN squared, rounding hides the noise. */
constexpr double kQuiet = 0.15;
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

/* Only of what all pixels do not have in common. Pixels at the ends of the
 * range are cut. */
Correlations
correlations_of (const std::vector<SeenFrame> &frames, const Stack &stack,
    const Image<float> &dark)
{
  const int width = stack.mean.width (), height = stack.mean.height ();
  const double middle = mean_of (stack.mean.view ());
  const double light = std::max (1.0, middle - mean_of (dark.view ()));
  Image<float> rest (width, height), before;
  double across = 0.0, down = 0.0, time = 0.0, squares = 0.0, pixels = 0.0;
  for (const SeenFrame &frame : frames) {
    const double more = mean_of (frame.picture.view ()) - middle;
    each_pixel (rest, [&] (int x, int y) {
      const bool cut = stack.zeros.at (x, y) > 0 || stack.full.at (x, y) > 0;
      const double part =
          double (stack.mean.at (x, y) - dark.at (x, y)) / light;
      rest.at (x, y) = cut ? 0.0f
                           : float (frame.picture.at (x, y) - more * part) -
                                 stack.mean.at (x, y);
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

/* What neighbours two pixels apart have in common beyond the light around them,
 * as a part of the light: no noise, and not the pixels' own sensitivity. */
double
texture_of (const Image<float> &light, ImageView<const std::uint8_t> good)
{
  const int width = light.width (), height = light.height ();
  const Image<float> even = smooth (light);
  Image<float> rest (width, height);
  each_pixel (rest, [&] (int x, int y) {
    if (good.at (x, y) != 0)
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

Stack
part_of (const std::vector<SeenFrame> &frames, std::size_t first,
    std::size_t count, int largest)
{
  std::vector<SeenFrame> part;
  for (std::size_t i = first; i < first + count; i++) {
    part.push_back ({frames[i].time, frames[i].arrival, frames[i].damaged,
        frames[i].picture});
  }
  return stack_of (part, largest);
}

} // namespace

Measured
change_between (const Stack &a, const Stack &b, const Image<float> &dark)
{
  const int width = a.mean.width () / kBlock;
  const int height = a.mean.height () / kBlock;
  const double light_a =
      std::max (1.0, mean_of (a.mean.view ()) - mean_of (dark.view ()));
  const double light_b =
      std::max (1.0, mean_of (b.mean.view ()) - mean_of (dark.view ()));
  double squares = 0.0, expected = 0.0, blocks = 0.0;
  for (int j = 0; j < height; j++)
    for (int i = 0; i < width; i++) {
      double step = 0.0, variance = 0.0;
      bool cut = false;
      for (int y = j * kBlock; y < (j + 1) * kBlock; y++)
        for (int x = i * kBlock; x < (i + 1) * kBlock; x++) {
          const double black = double (dark.at (x, y));
          step += (double (a.mean.at (x, y)) - black) * light_b / light_a -
                  (double (b.mean.at (x, y)) - black);
          /* Rounding alone has a variance, too. */
          variance +=
              std::max (1.0 / 12.0, double (a.variance.at (x, y))) / a.frames +
              std::max (1.0 / 12.0, double (b.variance.at (x, y))) / b.frames;
          cut |= a.full.at (x, y) > 0 || b.full.at (x, y) > 0;
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
check_pictures (const std::vector<SeenFrame> &frames, const Image<float> &dark,
    int largest, Finding &finding)
{
  const std::size_t half = frames.size () / 2;
  const Stack all = stack_of (frames, largest, &dark);
  const Image<float> light = difference (all.mean, dark);
  finding.measure (
      "light that one of 2x2 pixels lacks", {100.0 * mosaic_of (light), 0.0});
  finding.measure (kChange, change_between (part_of (frames, 0, half, largest),
                                part_of (frames, half, half, largest), dark));
  // A picture that is not even and moves a little looks like noise.
  if (!finding.is_ill ())
    finding.measure ("texture",
        {100.0 * texture_of (light,
                     find_defects (dark, all.mean, largest).good.view ()),
            0.1});
  if (!finding.is_ill ())
    judge_noise (correlations_of (frames, all, dark), finding);
}

} // namespace codedexposure

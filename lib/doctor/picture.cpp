/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/statistics.h"

namespace codedexposure
{

namespace
{

/* Light of the brightest pixels of a mosaic, by that of the darkest, more than
 * which no sensor without colours has. */
constexpr double kMosaic = 1.05;
/* Below this variance over time, DN squared, rounding hides the noise. */
constexpr double kQuiet = 0.15;
/* Correlation of noise that a linear camera does not have. */
constexpr double kCorrelated = 0.02, kMixedFrames = 0.05;
/* Half of the side of the box whose mean is the light without texture. */
constexpr int kBox = 7;
/* Texture beyond that part of the light is a defect of the mirrors or dust. */
constexpr double kSpot = 0.12;
/* Pixels with less than that part of the light see no mirrors. */
constexpr double kCovered = 0.3;
/* Pixels of a block whose means are compared, and how often their squares may
 * be what noise makes them. */
constexpr int kBlock = 4;
constexpr double kMoved = 3.0;

/** Sums of rectangles of a picture. */
class Sums
{
public:
  template <typename Value>
  Sums (int width, int height, Value value)
      : width_ (width), sums_ (std::size_t ((width + 1) * (height + 1)))
  {
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++)
        at (x + 1, y + 1) =
            at (x, y + 1) + at (x + 1, y) - at (x, y) + value (x, y);
  }
  /** Of [left, right) and [top, bottom). */
  double of (int left, int top, int right, int bottom) const
  {
    return at (right, bottom) - at (left, bottom) - at (right, top) +
           at (left, top);
  }

private:
  double at (int x, int y) const
  {
    return sums_[std::size_t (y * (width_ + 1) + x)];
  }
  double &at (int x, int y)
  {
    return sums_[std::size_t (y * (width_ + 1) + x)];
  }

  int width_;
  std::vector<double> sums_;
};

void
judge_mosaic (const Image<float> &light, Finding &finding)
{
  std::array<std::array<double, 2>, 2> sums = {};
  each_pixel (light, [&] (int x, int y) {
    sums[std::size_t (y % 2)][std::size_t (x % 2)] += double (light.at (x, y));
  });
  const auto [low, high] =
      std::minmax ({sums[0][0], sums[0][1], sums[1][0], sums[1][1]});
  if (high > kMosaic * std::max (low, 1.0))
    finding.blame (
        "colour", "of four neighbouring pixels, one always has " +
                      fixed (100.0 * (1.0 - low / high), 0) +
                      " % less light than another: each sees one colour only");
}

/** Of the noise of pixels: with the next one in x, in y, and in time. */
struct Correlations {
  double across = 0.0, down = 0.0, over_time = 0.0;
  double variance = 0.0; ///< DN squared
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
      squares / std::max (1.0, pixels) * count / (count - 1.0)};
}

void
judge_noise (const Correlations &noise, Finding &finding)
{
  if (noise.variance < kQuiet)
    return;
  const double most = std::max (noise.across, noise.down);
  const double least = std::min (noise.across, noise.down);
  const auto percent = [] (double part) {
    return fixed (100.0 * part, 0) + " %";
  };
  if (noise.over_time > kMixedFrames)
    finding.blame ("noise-reduction",
        "the noise of a frame has " + percent (noise.over_time) +
            " in common with that of the frame before: the camera mixes "
            "frames");
  else if (least < -kCorrelated)
    finding.blame ("sharpening",
        "the noise of neighbouring pixels has opposite signs (correlation " +
            percent (least) + "): the camera makes them differ more");
  else if (most > kCorrelated)
    finding.blame ("noise-reduction", "the noise of neighbouring pixels has " +
                                          percent (most) +
                                          " in common: the camera mixes them");
}

/* What neighbours two pixels apart have in common beyond the mean around them,
 * as a part of the light: no noise, and not the pixels' own sensitivity. */
double
texture_of (const Image<float> &light)
{
  const int width = light.width (), height = light.height ();
  std::vector<float> values;
  each_pixel (
      light, [&] (int x, int y) { values.push_back (light.at (x, y)); });
  const float least = float (kCovered) * median (std::move (values));
  const Sums sums (
      width, height, [&] (int x, int y) { return double (light.at (x, y)); });
  const Sums uncovered (width, height,
      [&] (int x, int y) { return light.at (x, y) > least ? 0.0 : 1.0; });
  Image<float> rest (width, height);
  each_pixel (rest, [&] (int x, int y) {
    const int left = std::max (0, x - kBox), top = std::max (0, y - kBox);
    const int right = std::min (width, x + kBox + 1);
    const int bottom = std::min (height, y + kBox + 1);
    if (uncovered.of (left, top, right, bottom) > 0.5)
      return;
    const double mean = sums.of (left, top, right, bottom) /
                        double ((right - left) * (bottom - top));
    const double part = double (light.at (x, y)) / mean - 1.0;
    rest.at (x, y) = float (std::clamp (part, -kSpot, kSpot));
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
judge_change (const Measured &change, Finding &finding)
{
  if (change.value - 2.0 * change.sigma > kMoved)
    finding.blame ("moving",
        "the same mask does not make the same picture again: pixels change " +
            shown (std::sqrt (change.value)) + " times as much as by noise");
}

void
check_pictures (const std::vector<SeenFrame> &frames, const Image<float> &dark,
    int largest, Finding &finding)
{
  if (frames.size () < 4)
    return;
  const std::size_t half = frames.size () / 2;
  const Stack all = stack_of (frames, largest, &dark);
  const Image<float> light = difference (all.mean, dark);
  judge_mosaic (light, finding);
  judge_change (change_between (part_of (frames, 0, half, largest),
                    part_of (frames, half, half, largest), dark),
      finding);
  if (!finding.is_ill ())
    judge_noise (correlations_of (frames, all, dark), finding);
  if (!finding.is_ill ())
    finding.measure ("texture", {100.0 * texture_of (light), 0.1});
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/blur_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <iterator>
#include <numbers>

#include "base/statistics.h"
#include "calibrate/gratings.h"
#include "calibrate/response.h"
#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

constexpr int kBlock = 16;       // pixels, at least
constexpr int kBlocks = 32;      // along a side, at most
constexpr int kLeastPixels = 40; // of a block
/* Places of a pixel between two mirrors that are told apart: as gratings move
 * by whole mirrors, harmonics mix in a way that depends on it. */
constexpr std::size_t kPlaces = 16;
constexpr std::array kHarmonics = {1, 3, 5};
constexpr std::size_t kTerms = kHarmonics.size ();
/* Errors of the powers of harmonics and of the squared swing, relative. */
constexpr double kPowerError = 0.01, kSwingError = 0.03;
/* Of the blur's growth over the field, relative: lenses blur in other ways,
 * too. */
constexpr double kSlopeError = 0.0045;

using Powers = std::array<double, kTerms>;
/* Parts of a block's pixels by their place; they add up to 1. */
using Places = std::array<double, kPlaces>;

/* Amplitudes at the harmonics, squared; @light of each phase. */
template <typename Light>
double
power_at (int harmonic, int period, Light light)
{
  std::complex<double> sum = 0.0;
  for (int k = 0; k < period; k++)
    sum += light (k) *
           std::polar (1.0, -2.0 * std::numbers::pi * harmonic * k / period);
  return std::norm (sum) * 4.0 / (double (period) * period);
}

/* What a grating gives at a blur, for light of 1. */
struct Expected {
  double variance; // mirrors squared
  std::array<Powers, kPlaces> powers;

  Powers at (const Places &places) const
  {
    Powers sum = {};
    for (std::size_t i = 0; i < kPlaces; i++)
      for (std::size_t h = 0; h < kTerms; h++)
        sum[h] += places[i] * powers[i][h];
    return sum;
  }
};

/* The same at growing blurs. */
std::vector<Expected>
expected_of (int period, double side)
{
  std::vector<Expected> all;
  for (double sigma = 0.05; sigma < 0.75 * period; sigma *= 1.06) {
    const GratingResponse response (period, side, sigma);
    Expected &entry = all.emplace_back (Expected{sigma * sigma, {}});
    for (std::size_t i = 0; i < kPlaces; i++) {
      const auto at = response.entry ((double (i) + 0.5) / kPlaces);
      for (std::size_t h = 0; h < kTerms; h++)
        entry.powers[i][h] = power_at (kHarmonics[h], period,
            [&] (int k) { return double (response.at (at, k).light); });
    }
  }
  return all;
}

/* Means over the pixels of a block. */
struct BlockPowers {
  Powers powers = {};
  double noise = 0.0; // power of it in each harmonic
  double swing = 0.0; // squared
  double pixels = 0.0;
  Places places = {};
};

/* The place of a coordinate between two mirrors. */
std::size_t
place_of (double mirror)
{
  return std::min (kPlaces - 1,
      std::size_t ((mirror - std::floor (mirror)) * double (kPlaces)));
}

BlockPowers
powers_of (Axis axis, const GratingStack &stack,
    ImageView<const std::uint8_t> good, const Rect &block,
    const Mapping *mapping)
{
  const auto &frames = axis == Axis::x ? stack.x : stack.y;
  const int period = int (frames.size ());
  BlockPowers sum;
  const int step = stack.step;
  for (int row = (block.y + step - 1) / step; row * step < block.bottom ();
       row++)
    for (int column = (block.x + step - 1) / step;
         column * step < block.right (); column++) {
      const int x = column * step, y = row * step;
      if (good.at (x, y) == 0)
        continue;
      const auto light = [&] (int k) {
        return double (frames[std::size_t (k)].at (column, row));
      };
      for (std::size_t h = 0; h < kTerms; h++)
        sum.powers[h] += power_at (kHarmonics[h], period, light);
      /* Gratings that are on for half of a period have no even harmonics. */
      sum.noise +=
          0.5 * (power_at (2, period, light) + power_at (4, period, light));
      const double swing =
          double (stack.white.at (x, y)) - double (stack.dark.at (x, y));
      sum.swing += swing * swing;
      sum.pixels++;
      if (mapping) {
        const Position mirror = mapping->mirror_at (x, y);
        sum.places[place_of (axis == Axis::x ? mirror.x : mirror.y)]++;
      }
    }
  for (double &part : sum.places)
    part = mapping ? part / std::max (1.0, sum.pixels) : 1.0 / kPlaces;
  const double scale = 1.0 / std::max (1.0, sum.pixels);
  for (double &power : sum.powers)
    power = power * scale - sum.noise * scale;
  sum.noise *= scale;
  sum.swing *= scale;
  return sum;
}

/* The blur whose harmonics fit best: variance in mirrors squared. */
Measured
variance_of (const BlockPowers &seen, const std::vector<Expected> &entries)
{
  std::vector<double> misfits;
  std::array<double, kTerms> weights;
  for (std::size_t h = 0; h < kTerms; h++) {
    const double power = std::max (0.0, seen.powers[h]);
    const double error =
        std::pow (kPowerError * seen.powers[0], 2.0) * 0.1 +
        std::pow (kPowerError * power, 2.0) +
        (2.0 * power * seen.noise + seen.noise * seen.noise) / seen.pixels;
    weights[h] = 1.0 / std::max (1e-12, error);
  }
  const double swing_weight = 1.0 / std::pow (kSwingError * seen.swing, 2.0);
  for (const Expected &entry : entries) {
    double pp = swing_weight, ps = swing_weight * seen.swing;
    double ss = swing_weight * seen.swing * seen.swing;
    const Powers powers = entry.at (seen.places);
    for (std::size_t h = 0; h < kTerms; h++) {
      pp += weights[h] * powers[h] * powers[h];
      ps += weights[h] * powers[h] * seen.powers[h];
      ss += weights[h] * seen.powers[h] * seen.powers[h];
    }
    misfits.push_back (ss - ps * ps / pp);
  }
  const auto least = std::ranges::min_element (misfits);
  const std::size_t at = std::size_t (least - misfits.begin ());
  if (at == 0 || at + 1 == misfits.size ())
    return {entries[at].variance, std::max (0.02, 0.2 * entries[at].variance)};
  /* A parabola through three points that are not evenly spaced. */
  const double x0 = entries[at - 1].variance, x1 = entries[at].variance,
               x2 = entries[at + 1].variance;
  const double y0 = misfits[at - 1], y1 = misfits[at], y2 = misfits[at + 1];
  const double d01 = (y1 - y0) / (x1 - x0), d12 = (y2 - y1) / (x2 - x1);
  const double curve = (d12 - d01) / (x2 - x0);
  const double best = 0.5 * (x0 + x1 - d01 / std::max (1e-30, curve));
  return {std::clamp (best, x0, x2), 1.0 / std::sqrt (std::max (1e-12, curve))};
}

} // namespace

double
BlurMap::median () const
{
  std::vector<float> known;
  std::ranges::copy_if (variance.pixels (), std::back_inserter (known),
      [] (float value) { return value >= 0.0f; });
  return std::sqrt (double (codedexposure::median (std::move (known))));
}

BlurMap
map_blur (const GratingStack &stack, ImageView<const std::uint8_t> good,
    double magnification, const Mapping *mapping)
{
  BlurMap map;
  map.block = std::max (
      kBlock, (std::max (good.width, good.height) + kBlocks - 1) / kBlocks);
  map.variance = Image<float> (std::max (1, good.width / map.block),
      std::max (1, good.height / map.block));
  map.sigma = map.variance;
  const auto of_x = expected_of (int (stack.x.size ()), 1.0 / magnification);
  const auto of_y = expected_of (int (stack.y.size ()), 1.0 / magnification);
  const double scale = magnification * magnification;
  each_pixel (map.variance, [&] (int i, int j) {
    const Rect block = {i * map.block, j * map.block,
        std::min (map.block, good.width - i * map.block),
        std::min (map.block, good.height - j * map.block)};
    const BlockPowers x = powers_of (Axis::x, stack, good, block, mapping);
    const BlockPowers y = powers_of (Axis::y, stack, good, block, mapping);
    map.variance.at (i, j) = -1.0f;
    if (x.pixels < kLeastPixels)
      return;
    const Measured vx = variance_of (x, of_x), vy = variance_of (y, of_y);
    map.variance.at (i, j) = float (scale * 0.5 * (vx.value + vy.value));
    map.sigma.at (i, j) = float (scale * 0.5 * std::hypot (vx.sigma, vy.sigma));
  });
  return map;
}

std::optional<FocusTilt>
fit_focus (const BlurMap &map, Extent camera)
{
  /* Places in half frames from the centre, variances, and their errors. */
  std::vector<Eigen::Vector4d> points;
  const double rx = 0.5 * camera.width, ry = 0.5 * camera.height;
  each_pixel (map.variance, [&] (int i, int j) {
    if (map.variance.at (i, j) >= 0.0f)
      points.emplace_back (((i + 0.5) * map.block - rx) / rx,
          ((j + 0.5) * map.block - ry) / ry, double (map.variance.at (i, j)),
          std::max (0.02, double (map.sigma.at (i, j))));
  });
  if (points.size () < 8)
    return std::nullopt;
  /* The blur without the defocus; the defocus, and its slopes in x and y. */
  const Residuals residuals = [&points] (const Eigen::VectorXd &f) {
    Eigen::VectorXd rest (Eigen::Index (points.size ()));
    for (Eigen::Index i = 0; i < rest.size (); i++) {
      const Eigen::Vector4d &p = points[std::size_t (i)];
      const double z = f[1] + f[2] * p[0] + f[3] * p[1];
      rest[i] = (p[2] - f[0] * f[0] - z * z) / p[3];
    }
    return rest;
  };
  double least = points[0][2];
  for (const Eigen::Vector4d &p : points)
    least = std::min (least, p[2]);
  /* The plane that is found depends on the start where the focus lies in the
   * middle of the frame. */
  std::optional<Minimum> best;
  for (int start = 0; start < 8; start++) {
    const double turn = start * std::numbers::pi / 4;
    Minimum now = minimise (residuals,
        Eigen::Vector4d (std::sqrt (least) + 0.01, 0.5, 0.5 * std::cos (turn),
            0.5 * std::sin (turn)),
        Eigen::Vector4d::Constant (1e-6));
    if (!best || now.squares () < best->squares ())
      best = std::move (now);
  }
  Eigen::Vector4d found = best->numbers;
  if (found[1] < 0.0)
    found.tail<3> () *= -1.0;
  const double excess = std::max (
      1.0, best->squares () / std::max (1.0, double (points.size ()) - 4.0));
  Eigen::MatrixXd normal = normal_of (best->slopes);
  normal.diagonal ().array () += 1e-9; // without a tilt, nothing is known
  const Eigen::MatrixXd covariance = excess * inverse_of (normal);
  /* Slopes by pixel, so that the direction is one on the frame. */
  const double sx = found[2] / rx, sy = found[3] / ry;
  const double slope = std::hypot (sx, sy);
  const double scatter = std::sqrt (
      std::max (covariance (2, 2) / (rx * rx), covariance (3, 3) / (ry * ry)));
  const double doubt = std::hypot (scatter, kSlopeError * slope);
  FocusTilt tilt;
  const double degrees = 180.0 / std::numbers::pi;
  tilt.direction = {std::atan2 (sy, sx) * degrees,
      std::min (180.0, degrees * doubt / std::max (1e-12, slope))};
  if (tilt.direction.value < 0.0)
    tilt.direction.value += 360.0;
  const double c = slope > 0.0 ? std::abs (sx) / slope : 1.0;
  const double s = slope > 0.0 ? std::abs (sy) / slope : 0.0;
  /* From corner to corner. */
  const double across = 2.0 * (c * rx + s * ry);
  tilt.growth = {slope * across, doubt * across};
  /* The blur grows with the square of a small tilt. */
  tilt.growth.sigma = std::min (tilt.growth.sigma,
      std::sqrt (2.0 * tilt.growth.value * tilt.growth.sigma));
  tilt.sharpest = std::abs (found[0]);
  return tilt;
}

} // namespace codedexposure

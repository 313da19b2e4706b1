/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <vector>

#include "base/statistics.h"
#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

/** Part of the differences of neighbours that are hot or dead pixels, dust and
 * borders of the mirrors at most. */
constexpr double kOdd = 0.02;

/** Index below which @p part of the counts are. */
int
index_of (const std::vector<int> &counts, double part)
{
  double all = 0.0, sum = 0.0;
  for (const int count : counts)
    all += count;
  for (std::size_t i = 0; i < counts.size (); i++) {
    sum += counts[i];
    if (sum >= part * all)
      return int (i);
  }
  return int (counts.size ()) - 1;
}

} // namespace

Measured
spread_of (const std::vector<double> &values)
{
  const double count = std::max (1.0, double (values.size ()));
  double mean = 0.0, squares = 0.0;
  for (const double value : values)
    mean += value / count;
  for (const double value : values)
    squares += (value - mean) * (value - mean);
  return {mean, std::sqrt (squares / std::max (1.0, count - 1.0))};
}

Level
level_of (ImageView<const std::uint16_t> picture, int largest)
{
  Level level;
  if (picture.width < 1 || picture.height < 1)
    return level;
  std::vector<int> counts (std::size_t (largest) + 1);
  std::vector<int> differences (std::size_t (largest) + 1);
  for (int y = 0; y < picture.height; y++) {
    const std::uint16_t *row = picture.row (y);
    int before = std::min (int (row[0]), largest);
    for (int x = 0; x < picture.width; x++) {
      const int value = std::min (int (row[x]), largest);
      level.bits_seen = std::uint16_t (level.bits_seen | value);
      counts[std::size_t (value)]++;
      differences[std::size_t (std::abs (value - before))] += x > 0;
      before = value;
    }
  }
  const double pixels = double (picture.width) * picture.height;
  for (std::size_t i = 0; i < counts.size (); i++)
    level.mean += double (i) * counts[i] / pixels;
  level.saturated = counts.back () / pixels;
  const int usual = index_of (differences, 1.0 - kOdd);
  double squares = 0.0, number = 0.0;
  for (int d = 0; d <= usual; d++) {
    squares += double (d) * d * differences[std::size_t (d)];
    number += differences[std::size_t (d)];
  }
  level.noise = number > 0.0 ? std::sqrt (squares / number / 2.0) : 0.0;
  return level;
}

double
rounding_doubt (double noise, int step)
{
  using std::numbers::pi;
  // The first harmonic of the error of rounding, which Gaussian noise damps.
  // Between coarse steps, two values alone vary by as much as a quarter of
  // their square, and may hide that there is no noise.
  const double hidden = step > 1 ? 0.25 : 1.0 / 12.0;
  const double of_rounding = hidden * step * step;
  const double before =
      std::max (noise * noise - of_rounding, 0.0) / (double (step) * step);
  return std::min (step / std::sqrt (12.0),
      step / (pi * std::numbers::sqrt2) * std::exp (-2.0 * pi * pi * before));
}

BorderLight
border_light (ImageView<const std::uint16_t> picture)
{
  const int rows = std::max (1, picture.height / 4);
  BorderLight light;
  for (int y = 0; y < rows; y++)
    for (int x = 0; x < picture.width; x++) {
      light.first += picture.at (x, y);
      light.last += picture.at (x, picture.height - 1 - y);
    }
  const double pixels = double (rows) * picture.width;
  return {light.first / pixels, light.last / pixels};
}

namespace
{

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kColumns = 24, kRows = 18, kFewBlocks = 30;
/* A block with less than this part of the light of bright ones, which few are
 * brighter than, sees no mirrors. */
constexpr double kNoMirrors = 0.1, kBright = 0.9;
/* A place further from all blocks that see mirrors, as a part of the frame, is
 * not known. */
constexpr double kFar = 1.0 / 6.0;
constexpr double kOutlier = 5.0;
/* Side of the blocks whose medians are the light without defects, pixels. */
constexpr int kSide = 24;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN ();

/** A surface of second order, and of fourth along the radius; u and v are -1
 * and 1 at the borders. */
using Terms = Eigen::Matrix<double, 1, 7>;
Terms
terms (double u, double v)
{
  const double square = u * u + v * v;
  return {1.0, u, v, u * u, u * v, v * v, square * square};
}

/** Pixels of @p block that are @p good, and of those around it where these are
 * few. */
std::vector<float>
good_values (ImageView<const float> picture, const Rect &block,
    ImageView<const std::uint8_t> good)
{
  constexpr int kAround = 4 * kSide;
  const auto enough =
      std::size_t (block.width) * std::size_t (block.height) / 4;
  std::vector<float> values;
  for (int more = 0; more <= kAround; more += kSide / 2) {
    values.clear ();
    const int right = std::min (block.right () + more, picture.width);
    const int below = std::min (block.bottom () + more, picture.height);
    for (int y = std::max (block.y - more, 0); y < below; y++)
      for (int x = std::max (block.x - more, 0); x < right; x++)
        if (good.width == 0 || good.at (x, y) != 0)
          values.push_back (picture.at (x, y));
    if (values.size () >= enough)
      return values;
  }
  return values.empty () ? std::vector{0.0f} : values;
}

/** Of the good values of each of @p columns x @p rows blocks. */
Image<float>
medians_of (ImageView<const float> picture, int columns, int rows,
    ImageView<const std::uint8_t> good = {})
{
  Image<float> medians (columns, rows);
  each_pixel (medians, [&] (int i, int j) {
    const int x = picture.width * i / columns, y = picture.height * j / rows;
    const Rect block{x, y, picture.width * (i + 1) / columns - x,
        picture.height * (j + 1) / rows - y};
    medians.at (i, j) = median (good_values (picture, block, good));
  });
  return medians;
}

} // namespace

Image<float>
flattened (const Image<float> &light, ImageView<const std::uint8_t> good)
{
  constexpr int kPlaces = 128;    // in a row, at which the surface is fitted
  constexpr double kLeast = 0.05; // of its light, where there is none
  const int width = light.width (), height = light.height ();
  const auto terms_at = [&] (int x, int y) {
    return terms ((2 * x + 1.0) / width - 1.0, (2 * y + 1.0) / height - 1.0);
  };
  const int step = std::max (1, width / kPlaces);
  MatrixXd normal = MatrixXd::Zero (7, 7);
  VectorXd right = VectorXd::Zero (7);
  double sum = 0.0, count = 0.0;
  for (int y = 0; y < height; y += step)
    for (int x = 0; x < width; x += step)
      if (good.at (x, y) != 0) {
        const Terms row = terms_at (x, y);
        normal += row.transpose () * row;
        right += double (light.at (x, y)) * row.transpose ();
        sum += double (light.at (x, y));
        count++;
      }
  if (count < kFewBlocks)
    return light;
  const VectorXd surface = inverse_of (normal) * right;
  const double least = std::max (kLeast * sum / count, 1e-3);
  Image<float> flat (width, height);
  each_pixel (flat, [&] (int x, int y) {
    flat.at (x, y) = light.at (x, y) /
                     float (std::max (least, terms_at (x, y).dot (surface)));
  });
  return flat;
}

Image<float>
smooth (const Image<float> &image, ImageView<const std::uint8_t> good)
{
  const int columns = std::max (1, image.width () / kSide);
  const int rows = std::max (1, image.height () / kSide);
  const double wide = double (image.width ()) / columns;
  const double high = double (image.height ()) / rows;
  const Image<float> medians = medians_of (image.view (), columns, rows, good);
  const auto place = [] (double at, int count) {
    const int low =
        std::clamp (int (std::floor (at)), 0, std::max (0, count - 2));
    return std::pair (low, count > 1 ? float (at - low) : 0.0f);
  };
  Image<float> result (image.width (), image.height ());
  each_pixel (image, [&] (int x, int y) {
    const auto [i, u] = place ((x + 0.5) / wide - 0.5, columns);
    const auto [j, v] = place ((y + 0.5) / high - 0.5, rows);
    const int right = std::min (i + 1, columns - 1);
    const int below = std::min (j + 1, rows - 1);
    const float top = (1 - u) * medians.at (i, j) + u * medians.at (right, j);
    const float bottom =
        (1 - u) * medians.at (i, below) + u * medians.at (right, below);
    result.at (x, y) = (1 - v) * top + v * bottom;
  });
  return result;
}

Measured
corner_loss (ImageView<const float> picture)
{
  const Image<float> blocks = medians_of (picture,
      std::min (kColumns, picture.width), std::min (kRows, picture.height));
  const float dark = float (kNoMirrors) * quantile (blocks, kBright);
  MatrixXd a (Index (blocks.pixels ().size ()), 7);
  VectorXd b (a.rows ()), weights = VectorXd::Ones (a.rows ());
  each_pixel (blocks, [&] (int i, int j) {
    const Index at = Index (j) * blocks.width () + i;
    a.row (at) = terms ((2 * i + 1.0) / blocks.width () - 1.0,
        (2 * j + 1.0) / blocks.height () - 1.0);
    b[at] = double (blocks.at (i, j));
    // A block beside one that sees no mirrors may be cut.
    each_near (blocks, {i, j}, 1, [&] (int x, int y) {
      if (!(blocks.at (x, y) >= dark) || !(dark > 0.0f))
        weights[at] = 0.0;
    });
  });

  VectorXd surface;
  MatrixXd inverse;
  double noise = 0.0;
  for (int round = 0; round < 3; round++) {
    if (weights.sum () <= kFewBlocks)
      return {kUnknown, kUnknown};
    inverse = inverse_of (normal_of (weights.asDiagonal () * a));
    surface = inverse * (a.transpose () * weights.cwiseProduct (b));
    const VectorXd residual = weights.cwiseProduct (b - a * surface);
    noise = residual.norm () / std::sqrt (weights.sum ());
    std::vector<double> sizes;
    for (Index i = 0; i < residual.size (); i++)
      if (weights[i] > 0.0)
        sizes.push_back (std::abs (residual[i]));
    const double limit = kOutlier * 1.4826 * median (std::move (sizes));
    for (Index i = 0; i < residual.size (); i++)
      weights[i] *= std::abs (residual[i]) <= limit;
  }
  if (!(surface[0] > 0.0))
    return {kUnknown, kUnknown};
  const auto is_seen = [&] (double u, double v) {
    bool seen = false;
    for (Index i = 0; i < a.rows (); i++)
      seen |= weights[i] > 0.0 && std::max (std::abs (a (i, 1) - u),
                                      std::abs (a (i, 2) - v)) < 2.0 * kFar;
    return seen;
  };
  Measured loss{kUnknown, kUnknown};
  if (!is_seen (0.0, 0.0))
    return loss;
  for (const double u : {-1.0, 1.0})
    for (const double v : {-1.0, 1.0}) {
      const Terms corner = terms (u, v);
      const double left = corner.dot (surface) / surface[0];
      if (!is_seen (u, v) || 1.0 - left < loss.value)
        continue;
      const Terms slope = (corner - left * terms (0.0, 0.0)) / surface[0];
      loss = {1.0 - left, noise * std::sqrt (slope.dot (slope * inverse))};
    }
  return loss;
}

} // namespace codedexposure

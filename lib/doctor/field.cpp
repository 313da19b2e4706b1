/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <vector>

#include <Eigen/Core>

#include "doctor/solve.h"

namespace codedexposure
{

namespace
{

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kColumns = 24, kRows = 18;
/* Of the median: a block that is darker sees no mirrors. */
constexpr double kNoMirrors = 0.1;
constexpr double kOutlier = 5.0;

/** A surface of second order, and of fourth along the radius; u and v are -1
 * and 1 at the borders. */
std::array<double, 7>
terms (double u, double v)
{
  const double square = u * u + v * v;
  return {1.0, u, v, u * u, u * v, v * v, square * square};
}

struct Block {
  int column = 0, row = 0;
  double u = 0.0, v = 0.0, light = 0.0;
};

double
median (std::vector<double> values)
{
  const auto middle = values.begin () + std::ptrdiff_t (values.size () / 2);
  std::ranges::nth_element (values, middle);
  return *middle;
}

std::vector<Block>
blocks_of (ImageView<const float> picture)
{
  std::vector<Block> blocks;
  const int columns = std::min (kColumns, picture.width);
  const int rows = std::min (kRows, picture.height);
  for (int row = 0; row < rows; row++)
    for (int column = 0; column < columns; column++) {
      const int x0 = picture.width * column / columns;
      const int x1 = picture.width * (column + 1) / columns;
      const int y0 = picture.height * row / rows;
      const int y1 = picture.height * (row + 1) / rows;
      std::vector<double> values;
      for (int y = y0; y < y1; y++)
        values.insert (
            values.end (), picture.row (y) + x0, picture.row (y) + x1);
      blocks.push_back ({column, row, double (x0 + x1) / picture.width - 1.0,
          double (y0 + y1) / picture.height - 1.0,
          median (std::move (values))});
    }
  return blocks;
}

} // namespace

Measured
corner_loss (ImageView<const float> picture)
{
  if (picture.width < 8 || picture.height < 8)
    return {};
  std::vector<Block> blocks = blocks_of (picture);
  std::vector<double> lights;
  for (const Block &block : blocks)
    lights.push_back (block.light);
  const double usual = median (lights);
  // A block beside them may be cut.
  std::vector<Block> dark;
  std::ranges::copy_if (
      blocks, std::back_inserter (dark), [usual] (const Block &block) {
        return block.light < kNoMirrors * usual;
      });
  std::erase_if (blocks, [&dark] (const Block &block) {
    return std::ranges::any_of (dark, [&block] (const Block &other) {
      return std::abs (other.column - block.column) <= 1 &&
             std::abs (other.row - block.row) <= 1;
    });
  });
  if (usual <= 0.0)
    return {};

  VectorXd surface;
  MatrixXd inverse;
  double noise = 0.0;
  for (int round = 0; round < 3 && blocks.size () > 30; round++) {
    MatrixXd a (Index (blocks.size ()), 7);
    VectorXd b (a.rows ());
    for (Index i = 0; i < a.rows (); i++) {
      const Block &block = blocks[std::size_t (i)];
      const auto row = terms (block.u, block.v);
      a.row (i) = Eigen::Map<const Eigen::RowVectorXd> (row.data (), 7);
      b[i] = block.light;
    }
    surface = least_squares (a, b);
    inverse = inverse_of (normal_of (a));
    const VectorXd residual = b - a * surface;
    noise = residual.norm () / std::sqrt (double (a.rows ()));
    std::vector<double> sizes;
    for (const double r : residual)
      sizes.push_back (std::abs (r));
    const double limit = kOutlier * 1.4826 * median (sizes);
    std::vector<Block> kept;
    for (Index i = 0; i < a.rows (); i++)
      if (std::abs (residual[i]) <= limit)
        kept.push_back (blocks[std::size_t (i)]);
    blocks = std::move (kept);
  }
  if (surface.size () == 0 || surface[0] <= 0.0)
    return {};
  Measured loss{-1.0, 0.0};
  for (const double u : {-1.0, 1.0})
    for (const double v : {-1.0, 1.0}) {
      const auto row = terms (u, v);
      const VectorXd corner = Eigen::Map<const VectorXd> (row.data (), 7);
      const double part = 1.0 - corner.dot (surface) / surface[0];
      if (part > loss.value)
        loss = {part,
            noise * std::sqrt (corner.dot (inverse * corner)) / surface[0]};
    }
  return loss;
}

} // namespace codedexposure

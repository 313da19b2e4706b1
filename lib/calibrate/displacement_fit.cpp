/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/displacement_fit.h"

#include <algorithm>

#include <Eigen/IterativeLinearSolvers>

namespace codedexposure
{

namespace
{

using Eigen::Index;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

/* Expected second differences from node to node, rms, mirrors: displacements
 * are smooth. */
constexpr double kRoughness = 0.02;

/* Of the residual, relative to the right side. */
constexpr double kTolerance = 1e-10;
constexpr int kMaxIterations = 500;

/* The cell between nodes in which the middle of a block lies, along one axis,
 * and the part of the way through it. */
struct Place {
  Index low;
  double part;

  Place (int block, int size, int length, int nodes)
  {
    const int end = std::min (length, (block + 1) * size);
    const double middle = 0.5 * (block * size + end - 1);
    const double at = middle / (length - 1) * double (nodes - 1);
    low = std::min (Index (at), Index (nodes) - 2);
    part = at - double (low);
  }
};

/* Of normal equations, whose unknowns are the displacements of the nodes. */
using Entries = std::vector<Eigen::Triplet<double>>;

/* Adds weight (sum of factors * nodes) ^ 2. */
void
add (Entries &entries, std::span<const Index> nodes,
    std::span<const double> factors, double weight)
{
  for (std::size_t i = 0; i < nodes.size (); i++)
    for (std::size_t j = 0; j < nodes.size (); j++)
      entries.emplace_back (
          nodes[i], nodes[j], weight * factors[i] * factors[j]);
}

/* Second differences along rows and columns. */
void
add_roughness (Entries &entries, Index columns, Index rows)
{
  constexpr double kFactors[] = {1.0, -2.0, 1.0};
  constexpr double kWeight = 1.0 / (kRoughness * kRoughness);
  for (Index row = 0; row < rows; row++)
    for (Index column = 0; column < columns; column++) {
      const Index at = row * columns + column;
      if (column > 0 && column + 1 < columns)
        add (entries, {{at - 1, at, at + 1}}, kFactors, kWeight);
      if (row > 0 && row + 1 < rows)
        add (entries, {{at - columns, at, at + columns}}, kFactors, kWeight);
    }
}

/* Zero if the equations have no solution. */
VectorXd
solve (const Entries &entries, const VectorXd &right)
{
  SparseMatrix matrix (right.size (), right.size ());
  matrix.setFromTriplets (entries.begin (), entries.end ());
  Eigen::ConjugateGradient<SparseMatrix> solver;
  solver.setTolerance (kTolerance);
  solver.setMaxIterations (kMaxIterations);
  solver.compute (matrix);
  const VectorXd nodes = solver.solve (right);
  return nodes.allFinite () ? nodes : VectorXd::Zero (right.size ());
}

} // namespace

double
reduced_chi_square (std::span<const PhaseFit::Block> blocks, double noise_ratio)
{
  double squares = 0.0, count = 0.0;
  for (const PhaseFit::Block &b : blocks)
    if (b.information > 0.0) {
      squares += b.score * b.score / (b.information * noise_ratio);
      count += 1.0;
    }
  return count > 0.0 ? squares / count : 0.0;
}

void
add_displacement (const Displacement &grid, std::vector<double> &nodes,
    std::span<const PhaseFit::Block> blocks, int block_size, Extent camera)
{
  Entries entries;
  VectorXd right = VectorXd::Zero (Index (nodes.size ()));
  const int across = (camera.width + block_size - 1) / block_size;
  for (std::size_t i = 0; i < blocks.size (); i++) {
    const Place x (int (i) % across, block_size, camera.width, grid.columns);
    const Place y (int (i) / across, block_size, camera.height, grid.rows);
    /* A block sees its displacement between the four nodes around it. */
    const Index node = y.low * grid.columns + x.low;
    const Index around[] = {
        node, node + 1, node + grid.columns, node + grid.columns + 1};
    const double factors[] = {(1 - x.part) * (1 - y.part),
        x.part * (1 - y.part), (1 - x.part) * y.part, x.part * y.part};
    add (entries, around, factors, blocks[i].information);
    for (std::size_t k = 0; k < 4; k++)
      right[around[k]] += factors[k] * blocks[i].score;
  }
  add_roughness (entries, grid.columns, grid.rows);
  Eigen::Map<VectorXd> (nodes.data (), right.size ()) += solve (entries, right);
}

} // namespace codedexposure

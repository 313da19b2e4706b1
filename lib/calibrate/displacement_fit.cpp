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

/* Normal equations of the displacements of the nodes. */
class NodeEquations
{
public:
  explicit NodeEquations (const Displacement &grid)
      : columns_ (grid.columns), rows_ (grid.rows),
        right_ (VectorXd::Zero (columns_ * rows_))
  {
  }

  void add_block (const PhaseFit::Block &block, const Place &x, const Place &y);
  void add_roughness ();
  VectorXd solve () const;

private:
  using Nodes = std::span<const Index>;
  using Factors = std::span<const double>;
  /* Of weight (sum of factors * nodes) ^ 2. */
  void add (Nodes nodes, Factors factors, double weight);

  Index columns_, rows_;
  std::vector<Eigen::Triplet<double>> entries_;
  VectorXd right_;
};

void
NodeEquations::add (Nodes nodes, Factors factors, double weight)
{
  for (std::size_t i = 0; i < nodes.size (); i++)
    for (std::size_t j = 0; j < nodes.size (); j++)
      entries_.emplace_back (
          nodes[i], nodes[j], weight * factors[i] * factors[j]);
}

/* A block sees its displacement between the four nodes around it. */
void
NodeEquations::add_block (
    const PhaseFit::Block &block, const Place &x, const Place &y)
{
  const Index node = y.low * columns_ + x.low;
  const Index nodes[] = {node, node + 1, node + columns_, node + columns_ + 1};
  const double factors[] = {(1 - x.part) * (1 - y.part), x.part * (1 - y.part),
      (1 - x.part) * y.part, x.part * y.part};
  add (nodes, factors, block.information);
  for (std::size_t i = 0; i < 4; i++)
    right_[nodes[i]] += factors[i] * block.score;
}

/* Second differences along rows and columns. */
void
NodeEquations::add_roughness ()
{
  constexpr double kFactors[] = {1.0, -2.0, 1.0};
  constexpr double kWeight = 1.0 / (kRoughness * kRoughness);
  for (Index row = 0; row < rows_; row++)
    for (Index column = 0; column < columns_; column++) {
      const Index at = row * columns_ + column;
      if (column > 0 && column + 1 < columns_)
        add ({{at - 1, at, at + 1}}, kFactors, kWeight);
      if (row > 0 && row + 1 < rows_)
        add ({{at - columns_, at, at + columns_}}, kFactors, kWeight);
    }
}

/* Zero if the equations have no solution. */
VectorXd
NodeEquations::solve () const
{
  SparseMatrix matrix (right_.size (), right_.size ());
  matrix.setFromTriplets (entries_.begin (), entries_.end ());
  Eigen::ConjugateGradient<SparseMatrix> solver;
  solver.setTolerance (kTolerance);
  solver.setMaxIterations (kMaxIterations);
  solver.compute (matrix);
  const VectorXd nodes = solver.solve (right_);
  return nodes.allFinite () ? nodes : VectorXd::Zero (right_.size ());
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
add_displacement (Displacement &grid, std::vector<double> &nodes,
    std::span<const PhaseFit::Block> blocks, int block_size, Extent camera)
{
  NodeEquations equations (grid);
  const int across = (camera.width + block_size - 1) / block_size;
  for (std::size_t i = 0; i < blocks.size (); i++)
    equations.add_block (blocks[i],
        {int (i) % across, block_size, camera.width, grid.columns},
        {int (i) / across, block_size, camera.height, grid.rows});
  equations.add_roughness ();
  const VectorXd change = equations.solve ();
  for (std::size_t i = 0; i < nodes.size (); i++)
    nodes[i] += change[Index (i)];
}

} // namespace codedexposure

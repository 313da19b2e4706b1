/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "moire/displacement_fit.h"

#include <algorithm>
#include <cmath>

namespace cexp
{

namespace
{

/* What is known of a displacement before it was seen: second differences from
 * node to node are about this many mirrors. */
constexpr double kRoughness = 0.02;

/* One block's share of the four nodes around its middle. */
struct Share {
  std::array<std::size_t, 4> node;
  std::array<double, 4> part;
};

class NodeSystem
{
public:
  NodeSystem (const Displacement &grid, std::span<const PhaseFit::Block> blocks,
      int block_size, Extent camera);

  std::vector<double> right () const;
  std::vector<double> times (const std::vector<double> &v) const;

private:
  template <typename Visit>
  void for_bends (Visit visit) const;

  std::size_t columns_, rows_;
  std::span<const PhaseFit::Block> blocks_;
  std::vector<Share> shares_;
};

NodeSystem::NodeSystem (const Displacement &grid,
    std::span<const PhaseFit::Block> blocks, int block_size, Extent camera)
    : columns_ (std::size_t (grid.columns)), rows_ (std::size_t (grid.rows)),
      blocks_ (blocks)
{
  struct Place {
    std::size_t low;
    double part;
    Place (int block, int size, int length, std::size_t nodes)
    {
      const int end = std::min (length, (block + 1) * size);
      const double middle = 0.5 * (block * size + end - 1);
      const double at = middle / (length - 1) * double (nodes - 1);
      low = std::min (std::size_t (at), nodes - 2);
      part = at - double (low);
    }
  };
  const int across = (camera.width + block_size - 1) / block_size;
  for (std::size_t i = 0; i < blocks.size (); i++) {
    const Place x (int (i) % across, block_size, camera.width, columns_);
    const Place y (int (i) / across, block_size, camera.height, rows_);
    const std::size_t node = y.low * columns_ + x.low;
    shares_.push_back ({{node, node + 1, node + columns_, node + columns_ + 1},
        {(1 - x.part) * (1 - y.part), x.part * (1 - y.part),
            (1 - x.part) * y.part, x.part * y.part}});
  }
}

std::vector<double>
NodeSystem::right () const
{
  std::vector<double> sums (columns_ * rows_);
  for (std::size_t i = 0; i < blocks_.size (); i++)
    for (std::size_t n = 0; n < 4; n++)
      sums[shares_[i].node[n]] += shares_[i].part[n] * blocks_[i].score;
  return sums;
}

/* Second differences along columns and rows. */
template <typename Visit>
void
NodeSystem::for_bends (Visit visit) const
{
  for (std::size_t j = 0; j < rows_; j++)
    for (std::size_t i = 0; i < columns_; i++) {
      const std::size_t at = j * columns_ + i;
      if (i > 0 && i + 1 < columns_)
        visit (at - 1, at, at + 1);
      if (j > 0 && j + 1 < rows_)
        visit (at - columns_, at, at + columns_);
    }
}

std::vector<double>
NodeSystem::times (const std::vector<double> &v) const
{
  std::vector<double> product (v.size ());
  for (std::size_t i = 0; i < blocks_.size (); i++) {
    double value = 0.0;
    for (std::size_t n = 0; n < 4; n++)
      value += shares_[i].part[n] * v[shares_[i].node[n]];
    for (std::size_t n = 0; n < 4; n++)
      product[shares_[i].node[n]] +=
          shares_[i].part[n] * value * blocks_[i].information;
  }
  const double stiffness = 1.0 / (kRoughness * kRoughness);
  for_bends ([&] (std::size_t a, std::size_t b, std::size_t c) {
    const double bend = stiffness * (v[a] - 2.0 * v[b] + v[c]);
    product[a] += bend;
    product[b] -= 2.0 * bend;
    product[c] += bend;
  });
  return product;
}

double
dot (const std::vector<double> &a, const std::vector<double> &b)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size (); i++)
    sum += a[i] * b[i];
  return sum;
}

/* Conjugate gradients. */
std::vector<double>
solve (const NodeSystem &system)
{
  std::vector<double> rest = system.right ();
  std::vector<double> at (rest.size ()), along = rest;
  const double start = dot (rest, rest);
  double square = start;
  for (int round = 0; round < 500 && square > 1e-20 * start; round++) {
    const std::vector<double> image = system.times (along);
    const double curvature = dot (along, image);
    if (!(curvature > 0.0))
      break;
    const double step = square / curvature;
    for (std::size_t i = 0; i < at.size (); i++) {
      at[i] += step * along[i];
      rest[i] -= step * image[i];
    }
    const double next = dot (rest, rest);
    for (std::size_t i = 0; i < at.size (); i++)
      along[i] = rest[i] + next / square * along[i];
    square = next;
  }
  return at;
}

} // namespace

double
excess (std::span<const PhaseFit::Block> blocks, double noise_ratio)
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
  const std::vector<double> change =
      solve (NodeSystem (grid, blocks, block_size, camera));
  for (std::size_t i = 0; i < nodes.size (); i++)
    nodes[i] += change[i];
}

} // namespace cexp

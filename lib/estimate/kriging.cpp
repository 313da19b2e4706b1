/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "estimate/kriging.h"

#include <Eigen/Cholesky>

namespace codedexposure
{

namespace
{

using Eigen::Index;
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/* The lower triangle in columns is the upper one in rows. */
Eigen::LLT<MatrixXd>
factor_of (const KrigingSystem &system)
{
  const Index m = Index (system.noise.size ());
  MatrixXd matrix = Map<const MatrixXd> (system.covariance.data (), m, m);
  matrix.diagonal () += Map<const VectorXd> (system.noise.data (), m);
  const double variance = matrix.diagonal ().mean ();
  Eigen::LLT<MatrixXd> factor (matrix);
  /* Larger than all covariances of a row together, the noise always suffices.
   */
  for (double more = 1e-12 * variance; factor.info () != Eigen::Success &&
                                       more <= 100.0 * double (m) * variance;
       more *= 10.0) {
    matrix.diagonal ().array () += more;
    factor.compute (matrix);
  }
  return factor;
}

} // namespace

std::vector<double>
solve_kriging (const KrigingSystem &system)
{
  const Index m = Index (system.noise.size ());
  const Index count = Index (system.targets.size ()) / m;
  const bool ordinary = !system.flat.empty ();
  MatrixXd solved (m, count + (ordinary ? 1 : 0));
  solved.leftCols (count) =
      Map<const MatrixXd> (system.targets.data (), m, count);
  if (ordinary)
    solved.col (count) = Map<const VectorXd> (system.flat.data (), m);
  factor_of (system).solveInPlace (solved);
  if (ordinary) {
    const Map<const VectorXd> flat (system.flat.data (), m);
    const double flat_flat = flat.dot (solved.col (count));
    for (Index k = 0; k < count; k++) {
      const double missing =
          system.flat_targets[std::size_t (k)] - flat.dot (solved.col (k));
      solved.col (k) += missing / flat_flat * solved.col (count);
    }
  }
  return {solved.data (), solved.data () + m * count};
}

KrigingSystem
slot_equations (const CodedCovariance &covariance, std::span<const Offset> taps,
    std::span<const int> elements, std::span<const double> noise)
{
  const std::size_t m = taps.size ();
  KrigingSystem system;
  system.covariance.resize (m * m);
  for (std::size_t i = 0; i < m; i++) {
    for (std::size_t j = i; j < m; j++)
      system.covariance[i * m + j] =
          covariance.coded ({taps[i].x - taps[j].x, taps[i].y - taps[j].y},
              elements[i], elements[j]);
    system.noise.push_back (noise[std::size_t (elements[i])]);
  }
  for (int slot = 0; slot < covariance.slots (); slot++)
    for (std::size_t i = 0; i < m; i++)
      system.targets.push_back (covariance.target (taps[i], elements[i], slot));
  return system;
}

std::vector<Offset>
disc (double radius)
{
  const int reach = int (radius);
  std::vector<Offset> places;
  for (int y = -reach; y <= reach; y++)
    for (int x = -reach; x <= reach; x++)
      if (x * x + y * y <= radius * radius)
        places.push_back ({x, y});
  return places;
}

} // namespace codedexposure

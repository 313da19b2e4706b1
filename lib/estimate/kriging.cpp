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
  if (m == 0)
    return {};
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
equations_of (const KrigingSystem &system, std::span<const int> taps)
{
  const std::size_t m = system.noise.size ();
  KrigingSystem part;
  for (const int a : taps) {
    for (const int b : taps)
      part.covariance.push_back (
          system.covariance[std::size_t (std::min (a, b)) * m +
                            std::size_t (std::max (a, b))]);
    part.noise.push_back (system.noise[std::size_t (a)]);
    if (!system.flat.empty ())
      part.flat.push_back (system.flat[std::size_t (a)]);
  }
  return part;
}

/* A mean that is not known is one of a very large variance. */
constexpr double kFlatVariance = 100.0;

SparseKriging::SparseKriging (KrigingSystem system, std::vector<TapPair> pairs)
    : system_ (std::move (system)), pairs_ (std::move (pairs)),
      flat_variance_ (system_.flat.empty () ? 0.0 : kFlatVariance),
      matrix_ (system_.covariance)
{
  const std::size_t m = system_.noise.size ();
  const auto flat = [&] (std::size_t i) {
    return system_.flat.empty () ? 0.0 : system_.flat[i];
  };
  for (std::size_t i = 0; i < m; i++) {
    for (std::size_t j = i; j < m; j++) {
      matrix_[i * m + j] += flat_variance_ * flat (i) * flat (j);
      matrix_[j * m + i] = matrix_[i * m + j];
    }
    matrix_[i * m + i] += system_.noise[i];
  }
}

/* Order-recursive least squares: a Cholesky factor that grows by a tap at a
 * time, and what the taps before it leave of each tap and of the target. */
struct SparseKriging::Search {
  const std::vector<double> &matrix;
  std::span<const TapPair> pairs;
  std::vector<double> target;
  std::size_t taps;
  std::vector<double> variances; ///< of each tap
  std::vector<double> together;  ///< covariances of the taps of each pair
  std::vector<bool> used;
  std::vector<int> chosen;
  std::vector<VectorXd> factor; ///< a column for each chosen tap
  double explained = 0.0;       ///< of the target's variance

  Search (const SparseKriging &kriging, std::vector<double> covariances)
      : matrix (kriging.matrix_), pairs (kriging.pairs_),
        target (std::move (covariances)), taps (target.size ()),
        used (taps, false)
  {
    for (std::size_t i = 0; i < taps; i++)
      variances.push_back (matrix[i * taps + i]);
    for (const auto &[a, b] : pairs)
      together.push_back (
          b < 0 ? 0.0 : matrix[std::size_t (a) * taps + std::size_t (b)]);
  }

  double gain (std::size_t pair) const
  {
    const auto alone = [&] (int i) {
      if (i < 0 || used[std::size_t (i)])
        return 0.0;
      const double left = target[std::size_t (i)];
      return left * left / variances[std::size_t (i)];
    };
    const auto [a, b] = pairs[pair];
    if (b < 0 || used[std::size_t (a)] || used[std::size_t (b)])
      return alone (a) + alone (b);
    const double ta = target[std::size_t (a)], tb = target[std::size_t (b)];
    const double va = variances[std::size_t (a)],
                 vb = variances[std::size_t (b)], both = together[pair];
    const double determinant = va * vb - both * both;
    return determinant > 1e-12 * va * vb
               ? (vb * ta * ta - 2.0 * both * ta * tb + va * tb * tb) /
                     determinant
               : std::max (alone (a), alone (b));
  }

  void add (int tap)
  {
    const auto i = std::size_t (tap);
    if (tap < 0 || used[i])
      return;
    used[i] = true;
    const double left = variances[i];
    if (left < 1e-9 * matrix[i * taps + i])
      return; // as good as known from the others
    VectorXd column =
        Map<const VectorXd> (matrix.data () + i * taps, Index (taps));
    for (const VectorXd &before : factor)
      column -= before[Index (i)] * before;
    column /= std::sqrt (left);
    const double along = target[i] / std::sqrt (left);
    for (std::size_t j = 0; j < taps; j++) {
      const double g = column[Index (j)];
      target[j] -= g * along;
      variances[j] -= g * g;
    }
    for (std::size_t p = 0; p < pairs.size (); p++)
      if (pairs[p].second >= 0)
        together[p] -= column[pairs[p].first] * column[pairs[p].second];
    explained += along * along;
    factor.push_back (std::move (column));
    chosen.push_back (tap);
  }

  bool add_best_pair ()
  {
    double best = 0.0;
    std::size_t pair = 0;
    for (std::size_t p = 0; p < pairs.size (); p++)
      if (const double more = gain (p); more > best) {
        best = more;
        pair = p;
      }
    if (best <= 0.0)
      return false;
    add (pairs[pair].first);
    add (pairs[pair].second);
    return true;
  }
};

std::vector<double>
SparseKriging::solve (std::span<const double> target, double flat,
    double variance, double excess) const
{
  const std::size_t m = system_.noise.size ();
  std::vector<double> covariances (target.begin (), target.end ());
  if (flat_variance_ > 0.0)
    for (std::size_t i = 0; i < m; i++)
      covariances[i] += flat_variance_ * flat * system_.flat[i];
  const Map<const VectorXd> sought (covariances.data (), Index (m));
  const double all =
      sought.dot (Map<const MatrixXd> (matrix_.data (), Index (m), Index (m))
                      .llt ()
                      .solve (sought));
  const double error =
      std::max (variance + flat_variance_ * flat * flat - all, 0.0);
  Search search (*this, covariances);
  /* Flat light is kept with one tap at least. */
  while ((search.chosen.empty () || all - search.explained > excess * error) &&
         search.add_best_pair ())
    ;
  return solve_with (search.chosen, target, flat);
}

std::vector<double>
SparseKriging::solve_with (std::span<const int> chosen,
    std::span<const double> target, double flat) const
{
  KrigingSystem part = equations_of (system_, chosen);
  for (const int tap : chosen)
    part.targets.push_back (target[std::size_t (tap)]);
  if (!part.flat.empty ())
    part.flat_targets = {flat};
  const std::vector<double> solved = solve_kriging (part);
  std::vector<double> weights (system_.noise.size (), 0.0);
  for (std::size_t i = 0; i < chosen.size (); i++)
    weights[std::size_t (chosen[i])] = solved[i];
  return weights;
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

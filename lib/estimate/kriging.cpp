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
  const Index m = Index (system_.noise.size ());
  Map<MatrixXd> matrix (matrix_.data (), m, m);
  if (flat_variance_ > 0.0) {
    const Map<const VectorXd> flat (system_.flat.data (), m);
    matrix += flat * (flat_variance_ * flat).transpose ();
  }
  matrix = MatrixXd (matrix.selfadjointView<Eigen::Lower> ());
  matrix.diagonal () += Map<const VectorXd> (system_.noise.data (), m);
}

/* Order-recursive least squares: a Cholesky factor that grows by a tap at a
 * time, and what the taps before it leave of each tap and of the target. */
struct SparseKriging::Search {
  const Map<const MatrixXd> matrix;
  std::span<const TapPair> pairs;
  VectorXd target;
  VectorXd variances;           ///< of each tap
  std::vector<double> together; ///< covariances of the taps of each pair
  Eigen::ArrayX<bool> used;
  std::vector<int> chosen;
  std::vector<VectorXd> factor; ///< a column for each chosen tap
  double explained = 0.0;       ///< of the target's variance

  Search (const Map<const MatrixXd> &all, std::span<const TapPair> taps,
      VectorXd covariances)
      : matrix (all), pairs (taps), target (std::move (covariances)),
        variances (matrix.diagonal ()),
        used (Eigen::ArrayX<bool>::Constant (target.size (), false))
  {
    for (const auto &[a, b] : pairs)
      together.push_back (b < 0 ? 0.0 : matrix (a, b));
  }

  double gain (std::size_t pair) const
  {
    const auto alone = [&] (int i) {
      return i < 0 || used[i] ? 0.0 : target[i] * target[i] / variances[i];
    };
    const auto [a, b] = pairs[pair];
    if (b < 0 || used[a] || used[b])
      return alone (a) + alone (b);
    const double ta = target[a], tb = target[b], va = variances[a],
                 vb = variances[b], both = together[pair];
    const double determinant = va * vb - both * both;
    return determinant > 1e-12 * va * vb
               ? (vb * ta * ta - 2.0 * both * ta * tb + va * tb * tb) /
                     determinant
               : std::max (alone (a), alone (b));
  }

  void add (int tap)
  {
    if (tap < 0 || used[tap])
      return;
    used[tap] = true;
    const double left = variances[tap];
    if (left < 1e-9 * matrix (tap, tap))
      return; // as good as known from the others
    VectorXd column = matrix.col (tap);
    for (const VectorXd &before : factor)
      column -= before[tap] * before;
    column /= std::sqrt (left);
    const double along = target[tap] / std::sqrt (left);
    target -= along * column;
    variances -= column.cwiseAbs2 ();
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
  const Index m = Index (target.size ());
  const Map<const MatrixXd> matrix (matrix_.data (), m, m);
  VectorXd sought = Map<const VectorXd> (target.data (), m);
  if (flat_variance_ > 0.0)
    sought +=
        flat_variance_ * flat * Map<const VectorXd> (system_.flat.data (), m);
  const double all = sought.dot (matrix.llt ().solve (sought));
  const double error =
      std::max (variance + flat_variance_ * flat * flat - all, 0.0);
  Search search (matrix, pairs_, std::move (sought));
  /* Flat light is kept with one tap at least. */
  while ((search.chosen.empty () || all - search.explained > excess * error) &&
         search.add_best_pair ())
    ;
  KrigingSystem part = equations_of (system_, search.chosen);
  for (const int tap : search.chosen)
    part.targets.push_back (target[std::size_t (tap)]);
  if (!part.flat.empty ())
    part.flat_targets = {flat};
  const std::vector<double> solved = solve_kriging (part);
  std::vector<double> weights (target.size (), 0.0);
  for (std::size_t i = 0; i < solved.size (); i++)
    weights[std::size_t (search.chosen[i])] = solved[i];
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

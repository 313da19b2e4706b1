/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "moire/rectify_weights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/cholesky.h"
#include "moire/response.h"
#include "stats/matern.h"

namespace cexp
{

namespace
{

/* Shares below are none. */
constexpr double kLeastShare = 1e-4;

} // namespace

SpaceCorrelation::SpaceCorrelation (int reach, double length) : far_ (2 * reach)
{
  for (int dy = -far_; dy <= far_; dy++)
    for (int dx = -far_; dx <= far_; dx++)
      values_.push_back (
          matern_3_2 (std::numbers::sqrt3 * std::hypot (dx, dy) / length));
}

Neighbourhood::Neighbourhood (const Elements &elements,
    const std::vector<int> &around, int reach, const SpaceCorrelation &space)
    : reach_ (reach)
{
  std::vector<int> kinds = around;
  std::sort (kinds.begin (), kinds.end ());
  kinds.erase (std::unique (kinds.begin (), kinds.end ()), kinds.end ());
  std::vector<double> in_time;
  for (const int e : kinds)
    for (const int f : kinds)
      in_time.push_back (elements.covariance (e, f));

  std::vector<std::size_t> kind;
  for (const int e : around) {
    kind.push_back (std::size_t (
        std::lower_bound (kinds.begin (), kinds.end (), e) - kinds.begin ()));
    light_.push_back (elements.light (e));
  }
  covariance_.resize (around.size () * around.size ());
  double *to = covariance_.data ();
  const int side = 2 * reach + 1;
  for (int a = 0; a < side * side; a++) {
    const double *time =
        in_time.data () + kind[std::size_t (a)] * kinds.size ();
    auto other = kind.begin ();
    for (int y = 0; y < side; y++) {
      const double *correlation = space.row (-(a % side), y - a / side);
      for (int x = 0; x < side; x++)
        *to++ = time[*other++] * correlation[x];
    }
  }
}

bool
Neighbourhood::even () const
{
  return std::equal (light_.begin () + 1, light_.end (), light_.begin ());
}

ShareProfile::ShareProfile (double side, double sigma)
{
  do
    values_.push_back (
        mirror_share (double (values_.size ()) / kSteps, side, sigma));
  while (values_.back () > kLeastShare);
}

WeightSolver::WeightSolver (const PixelView &view)
    : view_ (view), across_ (std::hypot (view.slope[0], view.slope[1]),
                        view.sigma * std::hypot (view.slope[0], view.slope[1])),
      down_ (std::hypot (view.slope[2], view.slope[3]),
          view.sigma * std::hypot (view.slope[2], view.slope[3]))
{
}

int
WeightSolver::reach () const
{
  const auto &slope = view_.slope;
  const double pixels = 0.5 * view_.taps + 0.5 + 2.5 * view_.sigma;
  const double along_x = std::abs (slope[0]) + std::abs (slope[1]);
  const double along_y = std::abs (slope[2]) + std::abs (slope[3]);
  return int (std::ceil (pixels * std::max (along_x, along_y)));
}

double
WeightSolver::own_share (double dx, double dy) const
{
  return across_.at (view_.slope[0] * dx + view_.slope[1] * dy) *
         down_.at (view_.slope[2] * dx + view_.slope[3] * dy);
}

/* What the pixel @dx, @dy pixels from where the middle mirror is seen gets of
 * each mirror; parts add up to 1. */
std::vector<WeightSolver::Share>
WeightSolver::shares_of (
    const Neighbourhood &mirrors, double dx, double dy) const
{
  const double at_x = view_.slope[0] * dx + view_.slope[1] * dy;
  const double at_y = view_.slope[2] * dx + view_.slope[3] * dy;
  const int reach = mirrors.reach ();
  std::vector<Share> shares;
  double sum = 0.0;
  for (int j = -reach; j <= reach; j++) {
    const double down = down_.at (at_y - j);
    for (int i = -reach; down > 0.0 && i <= reach; i++) {
      const double part = down * across_.at (at_x - i);
      if (part <= kLeastShare)
        continue;
      shares.push_back (
          {std::size_t ((j + reach) * (2 * reach + 1) + i + reach), part});
      sum += part;
    }
  }
  for (Share &share : shares)
    share.part /= sum;
  return shares;
}

WeightSolver::System
WeightSolver::system_of (
    const Neighbourhood &mirrors, double fx, double fy) const
{
  const std::size_t taps = std::size_t (view_.taps), pixels = taps * taps;
  const std::size_t count = mirrors.count ();
  const double half = 0.5 * (view_.taps - 1);
  std::vector<std::vector<Share>> shares;
  for (std::size_t p = 0; p < pixels; p++)
    shares.push_back (shares_of (
        mirrors, double (p % taps) - half - fx, double (p / taps) - half - fy));

  System system;
  system.matrix.resize (pixels * pixels);
  std::vector<double> with;
  for (std::size_t p = 0; p < pixels; p++) {
    with.assign (count, 0.0);
    double flat = 0.0;
    for (const Share &share : shares[p]) {
      const double *covariances = mirrors.covariances (share.mirror);
      for (std::size_t m = 0; m < count; m++)
        with[m] += share.part * covariances[m];
      flat += share.part * mirrors.light (share.mirror);
    }
    system.right.insert (system.right.end (), {with[count / 2], flat});
    for (std::size_t q = p; q < pixels; q++)
      for (const Share &share : shares[q])
        system.matrix[p * pixels + q] += share.part * with[share.mirror];
  }
  return system;
}

/* With C the covariance of the pixels, c theirs with the mirror and f their
 * light in a flat scene: w = C^-1 (c + lambda f) such that f w is the mirror's
 * light. */
std::vector<float>
WeightSolver::solve (const Neighbourhood &mirrors, double fx, double fy,
    std::span<const double> noises) const
{
  const System system = system_of (mirrors, fx, fy);
  const std::vector<double> &right = system.right;
  const std::size_t pixels = right.size () / 2, middle = mirrors.count () / 2;
  std::vector<float> weights;
  for (const double noise : noises) {
    std::vector<double> matrix = system.matrix, solved = right;
    for (std::size_t p = 0; p < pixels; p++)
      matrix[p * pixels + p] +=
          noise * noise * mirrors.covariances (middle)[middle];
    Cholesky (std::move (matrix), int (pixels)).solve (solved, 2);
    double light = 0.0, flat = 0.0;
    for (std::size_t p = 0; p < pixels; p++) {
      light += right[2 * p + 1] * solved[2 * p];
      flat += right[2 * p + 1] * solved[2 * p + 1];
    }
    const double lambda = (mirrors.light (middle) - light) / flat;
    for (std::size_t p = 0; p < pixels; p++)
      weights.push_back (float (solved[2 * p] + lambda * solved[2 * p + 1]));
  }
  weights.push_back (
      float (roughness (system.matrix) / mirrors.covariances (middle)[middle]));
  return weights;
}

double
WeightSolver::roughness (const std::vector<double> &matrix) const
{
  constexpr int kSteps = 4;
  const int taps = view_.taps, first = taps / 2 - kSteps / 2;
  const auto covariance = [&] (int p, int q) {
    return matrix[std::size_t (p * taps * taps + q)];
  };
  double sum = 0.0;
  for (int y = first; y < first + kSteps; y++)
    for (int x = first; x < first + kSteps; x++) {
      const int p = y * taps + x;
      for (const int q : {p + 1, p + taps})
        sum += covariance (p, p) + covariance (q, q) - 2.0 * covariance (p, q);
    }
  return sum / (4.0 * kSteps * kSteps);
}

} // namespace cexp

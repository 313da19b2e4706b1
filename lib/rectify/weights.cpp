/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "rectify/weights.h"

#include <algorithm>
#include <cmath>

#include "estimate/mirror_share.h"

namespace codedexposure
{

namespace
{

/* Smaller shares count as 0. */
constexpr double kMinShare = 1e-4;

} // namespace

Neighbourhood::Neighbourhood (const ElementMap &elements,
    const CodedCovariance &covariances, const std::vector<int> &around)
    : reach ((int (std::lround (std::sqrt (around.size ()))) - 1) / 2)
{
  for (const int element : around)
    light.push_back (elements.light (element));
  const int side = 2 * reach + 1, mirrors = side * side;
  covariance.reserve (around.size () * around.size ());
  for (int a = 0; a < mirrors; a++)
    for (int b = 0; b < mirrors; b++)
      covariance.push_back (
          covariances.coded ({a % side - b % side, a / side - b / side},
              around[std::size_t (a)], around[std::size_t (b)]));
}

bool
Neighbourhood::even () const
{
  return std::equal (light.begin () + 1, light.end (), light.begin ());
}

ShareProfile::ShareProfile (double side, double sigma)
{
  do
    values_.push_back (
        mirror_share (double (values_.size ()) / kSteps, side, sigma));
  while (values_.back () > kMinShare);
}

WeightSolver::WeightSolver (const PixelView &view)
    : view_ (view), across_ (std::hypot (view.slope[0], view.slope[1]),
                        view.sigma * std::hypot (view.slope[0], view.slope[1])),
      down_ (std::hypot (view.slope[2], view.slope[3]),
          view.sigma * std::hypot (view.slope[2], view.slope[3]))
{
}

int
WeightSolver::reach (int shifted) const
{
  const auto &slope = view_.slope;
  const double pixels = 0.5 * view_.taps + shifted + 0.5 + 2.5 * view_.sigma;
  const double along_x = std::abs (slope[0]) + std::abs (slope[1]);
  const double along_y = std::abs (slope[2]) + std::abs (slope[3]);
  return int (std::ceil (pixels * std::max (along_x, along_y)));
}

double
WeightSolver::own_share (double dx, double dy) const
{
  return share (view_.slope[0] * dx + view_.slope[1] * dy,
      view_.slope[2] * dx + view_.slope[3] * dy);
}

double
WeightSolver::work () const
{
  const int reach = this->reach ();
  double shares = 0.0;
  for (int y = -reach; y <= reach; y++)
    for (int x = -reach; x <= reach; x++)
      shares += share (x, y) > kMinShare;
  const double pixels = double (view_.taps) * view_.taps;
  return pixels * shares * (mirrors () + 0.5 * pixels);
}

/* Part of the light of the pixel @dx, @dy pixels from where the middle mirror
 * is seen that comes from each mirror; the parts add up to 1. */
std::vector<WeightSolver::Share>
WeightSolver::shares_of (
    const Neighbourhood &mirrors, double dx, double dy) const
{
  const double at_x = view_.slope[0] * dx + view_.slope[1] * dy;
  const double at_y = view_.slope[2] * dx + view_.slope[3] * dy;
  const int reach = mirrors.reach;
  std::vector<Share> shares;
  double sum = 0.0;
  for (int j = -reach; j <= reach; j++) {
    const double down = down_.at (at_y - j);
    for (int i = -reach; down > 0.0 && i <= reach; i++) {
      const double part = down * across_.at (at_x - i);
      if (part <= kMinShare)
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

/* Without noise. */
KrigingSystem
WeightSolver::equations (
    const Neighbourhood &mirrors, double fx, double fy) const
{
  const std::size_t taps = std::size_t (view_.taps), pixels = taps * taps;
  const std::size_t count = mirrors.count ();
  const double half = 0.5 * (view_.taps - 1);
  std::vector<std::vector<Share>> shares;
  for (std::size_t p = 0; p < pixels; p++)
    shares.push_back (shares_of (
        mirrors, double (p % taps) - half - fx, double (p / taps) - half - fy));

  KrigingSystem system;
  system.covariance.resize (pixels * pixels);
  system.flat_targets = {mirrors.light[count / 2]};
  std::vector<double> with;
  for (std::size_t p = 0; p < pixels; p++) {
    with.assign (count, 0.0);
    double flat = 0.0;
    for (const Share &share : shares[p]) {
      const double *covariances = mirrors.covariances (share.mirror);
      for (std::size_t m = 0; m < count; m++)
        with[m] += share.part * covariances[m];
      flat += share.part * mirrors.light[share.mirror];
    }
    system.targets.push_back (with[count / 2]);
    system.flat.push_back (flat);
    for (std::size_t q = p; q < pixels; q++)
      for (const Share &share : shares[q])
        system.covariance[p * pixels + q] += share.part * with[share.mirror];
  }
  return system;
}

std::vector<float>
WeightSolver::solve (const Neighbourhood &mirrors, double fx, double fy,
    std::span<const double> noises) const
{
  KrigingSystem system = equations (mirrors, fx, fy);
  const std::size_t middle = mirrors.count () / 2;
  const double variance = mirrors.covariances (middle)[middle];
  std::vector<float> weights, errors;
  for (const double noise : noises) {
    system.noise.assign (system.flat.size (), noise * noise * variance);
    const std::vector<double> solved = solve_kriging (system);
    weights.insert (weights.end (), solved.begin (), solved.end ());
    errors.push_back (
        float (squared_error (system, solved, variance) / variance));
  }
  weights.insert (weights.end (), errors.begin (), errors.end ());
  weights.push_back (float (roughness (system.covariance) / variance));
  return weights;
}

/* Without noise. @variance: of the target. */
double
WeightSolver::squared_error (const KrigingSystem &system,
    std::span<const double> weights, double variance)
{
  const std::size_t taps = weights.size ();
  double error = variance;
  for (std::size_t p = 0; p < taps; p++) {
    error += weights[p] * (weights[p] * system.covariance[p * taps + p] -
                              2.0 * system.targets[p]);
    for (std::size_t q = p + 1; q < taps; q++)
      error += 2.0 * weights[p] * weights[q] * system.covariance[p * taps + q];
  }
  return error;
}

double
WeightSolver::roughness (const std::vector<double> &covariances) const
{
  constexpr int kSteps = 4;
  const int taps = view_.taps, first = taps / 2 - kSteps / 2;
  const auto covariance = [&] (int p, int q) {
    return covariances[std::size_t (p * taps * taps + q)];
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

} // namespace codedexposure

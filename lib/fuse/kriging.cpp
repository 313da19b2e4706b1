/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/kriging.h"

#include <algorithm>
#include <cmath>

#include "base/cholesky.h"

namespace cexp
{

namespace
{

/* Adds what coded pixels have in common with slots and with each other, where
 * slots that are d apart have between[d + n - 1]. */
void
add_pairs (const Observation &observation, const std::vector<double> &between,
    std::vector<double> &cross, std::vector<double> &coded)
{
  const int n = observation.slots ();
  const std::size_t first = cross.size ();
  for (int a = 0; a < n; a++)
    for (int slot = 0; slot < n; slot++) {
      double sum = 0.0;
      for (const auto &[s, share] : observation.shares (a))
        sum += share * between[std::size_t (s - slot + n - 1)];
      cross.push_back (sum);
    }
  for (int a = 0; a < n; a++)
    for (int b = 0; b < n; b++) {
      double sum = 0.0;
      for (const auto &[slot, share] : observation.shares (b))
        sum += share * cross[first + std::size_t (a * n + slot)];
      coded.push_back (sum);
    }
}

} // namespace

Covariance::Covariance (
    const SceneClass &patch, const Observation &observation, int reach)
    : n_ (observation.slots ()), reach_ (reach),
      moving_ (patch.vx != 0.0 || patch.vy != 0.0 || patch.spread > 0.0)
{
  if (!moving_)
    fill_still (patch, observation);
  else if (patch.vx != 0.0 || patch.vy != 0.0)
    fill_moving (patch, observation);
  else
    fill_astray (patch, observation);
}

/* Space and time part where nothing moves. */
void
Covariance::fill_still (const SceneClass &patch, const Observation &observation)
{
  for (int dy = -reach_; dy <= reach_; dy++)
    for (int dx = -reach_; dx <= reach_; dx++)
      space_.push_back (scene_correlation (patch, dx, dy, 0));
  std::vector<double> between;
  for (int d = 1 - n_; d < n_; d++)
    between.push_back (std::pow (patch.correlation, std::abs (d)));
  add_pairs (observation, between, cross_, coded_);
}

void
Covariance::fill_moving (
    const SceneClass &patch, const Observation &observation)
{
  for (int dy = -reach_; dy <= reach_; dy++) {
    for (int dx = -reach_; dx <= reach_; dx++) {
      std::vector<double> between;
      for (int d = 1 - n_; d < n_; d++)
        between.push_back (scene_correlation (patch, dx, dy, d));
      add_pairs (observation, between, cross_, coded_);
    }
  }
}

/* The same in all directions, so that one correlation a distance will do. */
void
Covariance::fill_astray (
    const SceneClass &patch, const Observation &observation)
{
  const auto distances = std::size_t (2 * reach_ * reach_ + 1);
  std::vector<std::vector<double>> by_square (distances);
  std::vector<double> between (std::size_t (2 * n_ - 1));
  for (int dy = -reach_; dy <= reach_; dy++) {
    for (int dx = -reach_; dx <= reach_; dx++) {
      auto &alike = by_square[std::size_t (dx * dx + dy * dy)];
      for (int d = int (alike.size ()); d < n_; d++)
        alike.push_back (scene_correlation (patch, dx, dy, d));
      for (int d = 0; d < n_; d++)
        between[std::size_t (n_ - 1 - d)] = between[std::size_t (n_ - 1 + d)] =
            alike[std::size_t (d)];
      add_pairs (observation, between, cross_, coded_);
    }
  }
}

/* With C the covariance of the taps and c theirs with what is sought:
 * w = C^-1 (c + lambda 1) such that the weights sum to 1, so that flat light
 * comes out as it is. The residual is row `middle` of the inverse of the
 * bordered matrix, scaled. */
KrigingFilter
solve_kriging (const Covariance &covariance, const Observation &observation,
    std::span<const Offset> taps, std::span<const int> elements,
    std::span<const double> noise)
{
  const int m = int (taps.size ()), n = observation.slots ();
  std::vector<double> matrix;
  matrix.reserve (std::size_t (m * m));
  std::size_t middle = 0;
  for (int i = 0; i < m; i++) {
    const Offset a = taps[std::size_t (i)];
    const int element = elements[std::size_t (i)];
    if (a == Offset{})
      middle = std::size_t (i);
    for (int j = 0; j < m; j++) {
      const Offset b = taps[std::size_t (j)];
      matrix.push_back (covariance.coded (
          a.x - b.x, a.y - b.y, element, elements[std::size_t (j)]));
    }
    matrix[std::size_t (i * m + i)] += noise[std::size_t (element)];
  }

  const int columns = n + 2;
  std::vector<double> right;
  right.reserve (std::size_t (m * columns));
  for (std::size_t i = 0; i < taps.size (); i++) {
    for (int s = 0; s < n; s++)
      right.push_back (covariance.cross (taps[i].x, taps[i].y, elements[i], s));
    right.push_back (1.0);
    right.push_back (i == middle ? 1.0 : 0.0);
  }
  Cholesky (std::move (matrix), m).solve (right, columns);

  const auto at = [&] (std::size_t i, int column) {
    return right[i * std::size_t (columns) + std::size_t (column)];
  };
  std::vector<double> flat (std::size_t (columns), 0.0);
  for (std::size_t i = 0; i < taps.size (); i++)
    for (int k = 0; k < columns; k++)
      flat[std::size_t (k)] += at (i, k);
  const double flat_flat = flat[std::size_t (n)];

  KrigingFilter filter;
  for (int s = 0; s < n; s++) {
    const double lambda = (1.0 - flat[std::size_t (s)]) / flat_flat;
    const bool known = observation.exact () && observation.noise_free () &&
                       observation.shares (elements[middle])[0].slot == s;
    if (known) {
      for (std::size_t i = 0; i < taps.size (); i++)
        filter.slots.push_back (i == middle ? 1.0f : 0.0f);
      continue;
    }
    for (std::size_t i = 0; i < taps.size (); i++)
      filter.slots.push_back (float (at (i, s) + lambda * at (i, n)));
  }
  const double share = flat[std::size_t (n + 1)] / flat_flat;
  const auto inverse = [&] (std::size_t i) {
    return at (i, n + 1) - share * at (i, n);
  };
  for (std::size_t i = 0; i < taps.size (); i++)
    filter.residual.push_back (float (-inverse (i) / inverse (middle)));
  return filter;
}

KrigingFilter
solve_phase (const Covariance &covariance, const Observation &observation,
    const Phases &phases, int row, int x, std::span<const Offset> taps,
    std::span<const double> noise)
{
  std::vector<int> elements;
  for (const Offset &tap : taps)
    elements.push_back (phases.element (row, x, tap.x, tap.y));
  return solve_kriging (covariance, observation, taps, elements, noise);
}

std::vector<Offset>
disc (int radius)
{
  std::vector<Offset> places;
  for (int y = -radius; y <= radius; y++)
    for (int x = -radius; x <= radius; x++)
      if (x * x + y * y <= (radius + 0.5) * (radius + 0.5))
        places.push_back ({x, y});
  return places;
}

} // namespace cexp

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "estimate/scene_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace codedexposure
{

namespace
{

/* Matern's correlation of order 1, r K1 (r), to 1e-5. From a table, because the
 * Bessel function is slow. */
double
matern_1 (double r)
{
  constexpr int kSteps = 256, kReach = 24;
  static const std::vector<double> table = [] {
    std::vector<double> values = {1.0};
    for (int i = 1; i <= kSteps * kReach + 1; i++)
      values.push_back (
          double (i) / kSteps * std::cyl_bessel_k (1.0, double (i) / kSteps));
    return values;
  }();
  if (r >= kReach)
    return 0.0;
  const auto at = std::size_t (r * kSteps);
  const double part = r * kSteps - double (at);
  return table[at] + part * (table[at + 1] - table[at]);
}

double
space_correlation (const SceneClass &patch, double x, double y)
{
  const double r = std::hypot (x, y) / patch.length;
  return patch.smoothness > 1.25 ? (1.0 + r) * std::exp (-r) : matern_1 (r);
}

/* The mean over displacements of @radius in all directions. */
template <int kDirections>
double
mean_over_circle (const SceneClass &patch, double x, double y, double radius)
{
  static const auto kCircle = [] {
    std::array<std::pair<double, double>, kDirections> circle;
    for (int i = 0; i < kDirections; i++) {
      const double angle = 2.0 * std::numbers::pi * (i + 0.5) / kDirections;
      circle[std::size_t (i)] = {std::cos (angle), std::sin (angle)};
    }
    return circle;
  }();
  double sum = 0.0;
  for (const auto &[cosine, sine] : kCircle)
    sum += space_correlation (patch, x - radius * cosine, y - radius * sine);
  return sum / kDirections;
}

/* The mean over normally distributed displacements of @sigma along each axis,
 * at circles of equal weight. */
double
mean_over_normal (const SceneClass &patch, double x, double y, double sigma)
{
  constexpr int kRings = 12, kDirections = 16;
  double sum = 0.0;
  for (int ring = 0; ring < kRings; ring++) {
    const double beyond = 1.0 - (ring + 0.5) / kRings;
    sum += mean_over_circle<kDirections> (
        patch, x, y, sigma * std::sqrt (-2.0 * std::log (beyond)));
  }
  return sum / kRings;
}

} // namespace

double
scene_correlation (const SceneClass &patch, double dx, double dy, double slots)
{
  const double x = dx - patch.vx * slots, y = dy - patch.vy * slots;
  const double sigma = patch.spread * std::abs (slots);
  const double path = patch.speed * std::abs (slots);
  const double in_space = sigma > 0.0 ? mean_over_normal (patch, x, y, sigma)
                          : path > 0.0
                              ? mean_over_circle<24> (patch, x, y, path)
                              : space_correlation (patch, x, y);
  return in_space * std::pow (patch.correlation, std::abs (slots));
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/scene_model.h"

#include <cmath>
#include <numbers>

#include "stats/matern.h"

namespace cexp
{

namespace
{

void
add_grid (std::vector<SceneClass> &classes, double reach, double step,
    double correlation)
{
  for (double vx = -reach; vx <= reach; vx += step) {
    for (double vy = -reach; vy <= reach; vy += step)
      classes.push_back ({vx, vy, 12.0, 1.0, correlation});
  }
}

double
alike (const SceneClass &patch, double x, double y)
{
  const double r = std::hypot (x, y) / patch.length;
  return patch.smoothness > 1.25 ? matern_3_2 (r) : matern_1 (r);
}

/* The mean over normally distributed displacements of @sigma along each axis,
 * at points of equal weight. */
double
mean_around (const SceneClass &patch, double x, double y, double sigma)
{
  constexpr int kRings = 12, kDirections = 16;
  double sum = 0.0;
  for (int ring = 0; ring < kRings; ring++) {
    const double beyond = 1.0 - (ring + 0.5) / kRings;
    const double r = sigma * std::sqrt (-2.0 * std::log (beyond));
    for (int k = 0; k < kDirections; k++) {
      const double angle = 2.0 * std::numbers::pi * (k + 0.5) / kDirections;
      sum += alike (patch, x - r * std::cos (angle), y - r * std::sin (angle));
    }
  }
  return sum / (kRings * kDirections);
}

} // namespace

double
scene_correlation (const SceneClass &patch, double dx, double dy, double slots)
{
  const double x = dx - patch.vx * slots, y = dy - patch.vy * slots;
  const double astray = patch.spread * std::abs (slots);
  return (astray > 0.0 ? mean_around (patch, x, y, astray)
                       : alike (patch, x, y)) *
         std::pow (patch.correlation, std::abs (slots));
}

std::vector<SceneClass>
motion_classes ()
{
  std::vector<SceneClass> classes;
  classes.push_back ({0.0, 0.0, 12.0, 1.0, 0.9999});
  add_grid (classes, 4.0, 1.0, 0.99);
  for (const double vx : {-1.5, -0.5, 0.0, 0.5, 1.5})
    for (const double vy : {-1.5, -0.5, 0.0, 0.5, 1.5})
      if (vx != 0.0 || vy != 0.0)
        classes.push_back ({vx, vy, 12.0, 1.0, 0.99});
  add_grid (classes, 2.0, 1.0, 0.9);
  classes.push_back ({0.0, 0.0, 12.0, 1.0, 0.6});
  classes.push_back ({0.0, 0.0, 5.0, 1.5, 0.9});
  return classes;
}

} // namespace cexp

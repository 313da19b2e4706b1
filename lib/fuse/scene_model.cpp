/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/scene_model.h"

#include <cmath>

namespace cexp
{

namespace
{

/* r K1 (r), the Matern correlation of order 1, from a table: the Bessel
 * function takes its time. Off by less than 1e-5. */
double
matern_of_order_1 (double r)
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

/* Of order 1 or 3/2, with r not normalised. */
double
matern (double r, double smoothness)
{
  if (smoothness > 1.25)
    return (1.0 + r) * std::exp (-r);
  return matern_of_order_1 (r);
}

void
add_grid (std::vector<SceneClass> &classes, double reach, double step,
    double correlation)
{
  for (double vx = -reach; vx <= reach; vx += step) {
    for (double vy = -reach; vy <= reach; vy += step)
      classes.push_back ({vx, vy, 12.0, 1.0, correlation});
  }
}

} // namespace

double
scene_correlation (const SceneClass &patch, double dx, double dy, double slots)
{
  const double r =
      std::hypot (dx - patch.vx * slots, dy - patch.vy * slots) / patch.length;
  return matern (r, patch.smoothness) *
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

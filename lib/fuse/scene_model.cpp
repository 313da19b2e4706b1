/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/scene_model.h"

#include <cmath>

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

} // namespace

double
scene_correlation (const SceneClass &patch, double dx, double dy, double slots)
{
  const double r =
      std::hypot (dx - patch.vx * slots, dy - patch.vy * slots) / patch.length;
  return (patch.smoothness > 1.25 ? matern_3_2 (r) : matern_1 (r)) *
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

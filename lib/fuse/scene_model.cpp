/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/scene_model.h"

#include <algorithm>
#include <cmath>

namespace cexp
{

namespace
{

/* Matern correlation of order 1 or 3/2, unnormalised distance. */
double
matern (double r, double smoothness)
{
  if (smoothness > 1.25)
    return (1.0 + r) * std::exp (-r);
  return r < 1e-6 ? 1.0 : r * std::cyl_bessel_k (1.0, r);
}

void
add_grid (std::vector<SceneClass> &classes, double reach, double step,
    double correlation)
{
  for (double vx = -reach; vx <= reach; vx += step) {
    for (double vy = -reach; vy <= reach; vy += step) {
      const SceneClass patch{vx, vy, 12.0, 1.0, correlation};
      if (std::find (classes.begin (), classes.end (), patch) == classes.end ())
        classes.push_back (patch);
    }
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
motion_classes (bool fine)
{
  std::vector<SceneClass> classes;
  if (fine) {
    add_grid (classes, 4.0, 1.0, 0.99);
    for (const double vx : {-1.5, -0.5, 0.0, 0.5, 1.5})
      for (const double vy : {-1.5, -0.5, 0.0, 0.5, 1.5})
        if (vx != 0.0 || vy != 0.0)
          classes.push_back ({vx, vy, 12.0, 1.0, 0.99});
  } else {
    add_grid (classes, 2.0, 1.0, 0.99);
  }
  add_grid (classes, fine ? 2.0 : 1.0, 1.0, 0.9);
  classes.push_back ({0.0, 0.0, 12.0, 1.0, 0.6});
  classes.push_back ({0.0, 0.0, 5.0, 1.5, 0.9});
  return classes;
}

} // namespace cexp

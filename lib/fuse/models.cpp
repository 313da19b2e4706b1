/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/models.h"

#include <cmath>
#include <iterator>

#include "fuse/fuser.h"

namespace codedexposure::fuse
{

namespace
{

constexpr SceneClass kSlow{.correlation = 0.97, .spread = 0.2};
constexpr SceneClass kMedium{.correlation = 0.97, .spread = 0.5};

void
add_grid (std::vector<SceneClass> &classes, double reach, double step,
    double correlation)
{
  for (double vx = -reach; vx <= reach; vx += step) {
    for (double vy = -reach; vy <= reach; vy += step)
      classes.push_back ({vx, vy, 12.0, 1.0, correlation});
  }
}

/* Still and moving patches, up to 4 px per slot along each axis. */
std::vector<SceneClass>
patches ()
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

bool
is_lasting (const SceneClass &patch)
{
  return !patch.moves () && patch.correlation >= 0.99;
}

bool
is_passing (const SceneClass &patch)
{
  constexpr double kFastest = 2.0;
  return patch.directed () && patch.correlation >= 0.99 &&
         std::max (std::abs (patch.vx), std::abs (patch.vy)) <= kFastest;
}

} // namespace

/* Over frames, errors of the velocity grow from frame to frame. There are no
 * models of motion for many slots. */
Models
fast_models (int slots)
{
  if (slots > Fuser<std::uint8_t>::kMaxSlots)
    return {{SceneClass ()}, {}};
  return {{kSlow, kFastMotion}, {kSlow, kMedium, kFastMotion}};
}

MotionModels
motion_models ()
{
  MotionModels models{patches (), {}, {}};
  std::ranges::copy_if (
      models.of_frame, std::back_inserter (models.over_frames), is_lasting);
  std::ranges::copy_if (
      models.of_frame, std::back_inserter (models.over_one), is_passing);
  for (const SceneClass &slow : {kSlow, kFastMotion})
    models.of_frame.push_back (slow);
  for (const SceneClass &slow : {kSlow, kMedium})
    models.over_frames.push_back (slow);
  return models;
}

} // namespace codedexposure::fuse

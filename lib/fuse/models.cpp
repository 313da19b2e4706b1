/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/models.h"

#include <cmath>
#include <iterator>
#include <utility>

#include "fuse/fuser.h"

namespace codedexposure::fuse
{

namespace
{

constexpr SceneClass kSlow{.correlation = 0.97, .spread = 0.2};
constexpr SceneClass kMedium{.correlation = 0.97, .spread = 0.5};
/* Correlation from slot to slot, over frames, of patches that move. */
constexpr double kFollowerCorrelation = 0.98;

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

std::vector<std::size_t>
find_followed (const std::vector<SceneClass> &classes)
{
  std::vector<std::size_t> followed;
  for (std::size_t i = 0; i < classes.size (); i++)
    if (classes[i].directed () && classes[i].correlation >= 0.99)
      followed.push_back (i);
  std::ranges::stable_sort (followed, {}, [&] (std::size_t i) {
    return std::pair (
        std::floor (classes[i].vx / 2.0), std::floor (classes[i].vy / 2.0));
  });
  return followed;
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
  models.followed = find_followed (models.of_frame);
  for (const SceneClass &slow : {kSlow, kFastMotion})
    models.of_frame.push_back (slow);
  for (const SceneClass &slow : {kSlow, kMedium})
    models.over_frames.push_back (slow);
  return models;
}

SceneClass
follower (SceneClass patch)
{
  patch.correlation = kFollowerCorrelation;
  return patch;
}

} // namespace codedexposure::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The models of scenes that fusion chooses from. */
#pragma once

#include <algorithm>
#include <vector>

#include "estimate/scene_model.h"
#include "fuse/phases.h"

namespace codedexposure::fuse
{

/** Models for the coded frame alone, and those in their place where there are
 * neighbouring frames, the last of which does without them. With none of the
 * latter, neighbouring frames are not used. */
struct Models {
  std::vector<SceneClass> of_frame, over_frames;

  const std::vector<SceneClass> &with (Neighbours neighbours) const
  {
    return neighbours.any () ? over_frames : of_frame;
  }
  /** Those of @p neighbours that are used. */
  Neighbours used (Neighbours neighbours) const
  {
    return over_frames.empty () ? neighbours.none () : neighbours;
  }
  /** The largest number of models. */
  int most () const
  {
    return int (std::max (of_frame.size (), over_frames.size ()));
  }
};

/** Patches that move fast in any direction. */
inline constexpr SceneClass kFastMotion{.correlation = 0.85, .spread = 2.0};

/** What `fast` chooses between around each pixel. */
Models fast_models (int slots);

/** Models of motion, for `balanced` and `best`. */
struct MotionModels {
  std::vector<SceneClass> of_frame;
  /** Again with all neighbouring frames: patches that stay near their place. */
  std::vector<SceneClass> over_frames;
  /** Numbers of the classes of the frame that move in a known direction: the
   * pixels of neighbouring frames that show them are sought along their way.
   * Those of similar velocities, which share such pixels, are together. */
  std::vector<std::size_t> followed;
};
MotionModels motion_models ();
/** Such a class as it is over frames, where errors of its velocity add up. */
SceneClass follower (SceneClass patch);

} // namespace codedexposure::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Statistical models of scenes: how strongly the light of two points is
 * correlated before any frame is seen. */
#pragma once

#include <vector>

namespace codedexposure
{

/**
 * A kind of patch: a stationary random process that moves at a constant
 * velocity and slowly becomes another.
 *
 * The correlation of two points is Matern (distance in the moving patch /
 * length) times correlation ^ |slots between them|. Where the velocity is not
 * known exactly, it is the mean over all velocities that are possible: normally
 * distributed about (vx, vy) with `spread`, or of magnitude `speed` in any
 * direction. At most one of both is set; `speed` needs vx = vy = 0.
 */
struct SceneClass {
  double vx = 0.0, vy = 0.0; ///< px per slot
  double length = 5.0;       ///< px
  double smoothness = 1.5;   ///< Matern order: 1 or 1.5
  double correlation = 0.85; ///< per slot, in [0, 1]
  double spread = 0.0; ///< of velocities along each axis, rms, px per slot
  double speed = 0.0;  ///< px per slot

  /** Moves in a known direction. */
  bool directed () const { return vx != 0.0 || vy != 0.0; }
  bool moves () const { return directed () || spread > 0.0 || speed > 0.0; }

  bool operator== (const SceneClass &) const = default;
};

/** Correlation of two points of a patch that lie @p dx, @p dy px and @p slots
 * apart. */
double scene_correlation (
    const SceneClass &patch, double dx, double dy, double slots);

/** The classes that fusion chooses from. */
struct SceneModel {
  /** What `fast` chooses between around each pixel. */
  SceneClass slow{.correlation = 0.97, .spread = 0.2};
  SceneClass moving{.correlation = 0.85, .spread = 2.0};
  /** In place of `slow` where neighbouring coded frames are used, too: errors
   * of the velocity grow from frame to frame. */
  SceneClass slow_over_frames{.correlation = 0.97, .spread = 0.2};
  SceneClass medium_over_frames{.correlation = 0.97, .spread = 0.5};
  /** The only class of `fast` for schedules of more slots than motion models
   * exist for. */
  SceneClass plain;
  /** Standard deviation of a scene as a part of white; the ratio of noise to
   * scene follows from it. */
  double contrast = 0.25;

  bool operator== (const SceneModel &) const = default;
};

/** Still and moving patches for motion-adaptive fusion: up to 4 px per slot
 * along each axis. */
std::vector<SceneClass> motion_classes ();
/** Those of them whose patches are still there, in the same place, in the
 * coded frames before and after. */
std::vector<SceneClass> lasting_classes ();
/** Those that move so slowly, up to 2 px per slot along each axis, that the
 * last slots of the coded frame before and the first ones of the next show the
 * patch nearby. */
std::vector<SceneClass> passing_classes ();

} // namespace codedexposure

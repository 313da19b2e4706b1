/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What is believed of scenes before a frame is seen: how alike two points of
 * them are. */
#pragma once

#include <vector>

namespace cexp
{

/**
 * A kind of patch: a stationary random process that moves at a constant
 * velocity and slowly becomes another.
 *
 * The correlation of two points is Matern (distance in the moving patch /
 * length) times correlation ^ |slots between them|; where the velocity is not
 * known, its mean over velocities with a normal distribution about (vx, vy).
 */
struct SceneClass {
  double vx = 0.0, vy = 0.0; ///< px per slot
  double length = 5.0;       ///< px
  double smoothness = 1.5;   ///< Matern order: 1 or 1.5
  double correlation = 0.85; ///< per slot, in (0, 1]
  double spread = 0.0; ///< of velocities along each axis, rms, px per slot

  bool operator== (const SceneClass &) const = default;
};

/** Correlation of two points of a patch that lie @p dx, @p dy px and @p slots
 * apart. */
double scene_correlation (
    const SceneClass &patch, double dx, double dy, double slots);

/** The classes that fusion chooses from. */
struct SceneModel {
  /** What `fast` chooses between around each pixel. */
  SceneClass creeping{.correlation = 0.97, .spread = 0.2};
  SceneClass moving{.correlation = 0.85, .spread = 2.0};
  /** What it takes everything for under schedules of more slots than motion is
   * known for. */
  SceneClass plain;
  /** Standard deviation of a scene as a part of white: how far noise is
   * believed to be below the scene. */
  double contrast = 0.25;

  bool operator== (const SceneModel &) const = default;
};

/** Still and moving patches for motion-adaptive fusion: up to 4 px per slot
 * along each axis. */
std::vector<SceneClass> motion_classes ();

} // namespace cexp

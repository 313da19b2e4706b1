/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Statistical models of scenes: how strongly the light of two points is
 * correlated before any frame is seen. */
#pragma once

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

} // namespace codedexposure

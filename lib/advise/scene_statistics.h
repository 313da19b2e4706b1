/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What is assumed about a scene for predictions. */
#pragma once

#include <numbers>

#include "base/range.h"
#include "estimate/scene_model.h"

namespace codedexposure
{

/**
 * A texture that moves at a known speed in an unknown direction. Its light is a
 * stationary Gaussian process whose correlation at a distance d is Matern's of
 * order 3/2, (1 + q) e^-q with q = sqrt 3 d / detail.
 */
struct SceneStatistics {
  double level = 0.45;    ///< mean, part of white
  double contrast = 0.15; ///< standard deviation, part of white
  double detail = 5.0;    ///< length of the correlation, pixels
  double speed = 100.0;   ///< pixels a second

  /** Error when a number is out of range. */
  Result<void> check () const
  {
    return check_ranges ({
        {"level", level, 0.001, 1.0},
        {"contrast", contrast, 0.001, 1.0},
        {"detail (pixels)", detail, 0.1, 1000.0},
        {"speed (pixels/s)", speed, 0.0, 1e6},
    });
  }
  /** The texture for slots that begin @p pitch seconds apart. */
  SceneClass patch (double pitch) const
  {
    return {.length = detail / std::numbers::sqrt3,
        .correlation = 1.0,
        .speed = speed * pitch};
  }
};

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "advise/scene_statistics.h"

#include <numbers>

#include "base/range.h"

namespace codedexposure
{

Result<void>
SceneStatistics::check () const
{
  return check_ranges ({
      {"level", level, 0.001, 1.0},
      {"contrast", contrast, 0.001, 1.0},
      {"detail (pixels)", detail, 0.1, 1000.0},
      {"speed (pixels/s)", speed, 0.0, 1e6},
  });
}

SceneClass
SceneStatistics::patch (double pitch) const
{
  return {.length = detail / std::numbers::sqrt3,
      .correlation = 1.0,
      .speed = speed * pitch};
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How far a mapping is from the bench that it was measured on. */
#pragma once

#include <algorithm>
#include <cmath>

#include "bench/lens.h"
#include "mapping/mapping.h"

namespace codedexposure::test
{

/** By how many mirrors a corner of the frame is elsewhere than @p stand has
 * it. */
inline double
worst_error (const Mapping &mapping, const Alignment &stand)
{
  const auto [width, height] = mapping.camera ();
  const Homography truth = camera_to_mirrors (stand, width, height);
  double worst = 0.0;
  for (const double x : {0.0, width - 1.0})
    for (const double y : {0.0, height - 1.0}) {
      const Position found = mapping.mirror_at (x, y);
      const Projected seen = project (truth, x, y);
      worst = std::max (worst, std::hypot (found.x - seen.x, found.y - seen.y));
    }
  return worst;
}

} // namespace codedexposure::test

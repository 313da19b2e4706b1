/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the background has where regions cover it. */
#pragma once

#include <vector>

#include "base/geometry.h"
#include "schedule/schedule.h"

namespace codedexposure::fuse
{

/** A pixel of the background that a region covers, and the pixel of the same
 * element that replaces it. */
struct Cover {
  Offset at, from;
};

/** Of all pixels of all regions, in a frame of @p size. */
std::vector<Cover> find_covers (const Schedule &schedule, Extent size);

} // namespace codedexposure::fuse

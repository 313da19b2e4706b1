/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The table of docs/quality.md about the borders of regions. */
#pragma once

#include <vector>

#include "figures.h"
#include "scene.h"
#include "table.h"

namespace codedexposure::quality
{

/** PSNR of subframes and of fused frames beside the border of a region and away
 * from it, and of the same pixels where there is no border. */
Table regions_table (
    const std::vector<Scene> &scenes, const Progress &progress);

} // namespace codedexposure::quality

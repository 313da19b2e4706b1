/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where a second camera has more light than it can tell. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "base/image.h"

namespace codedexposure::fuse
{

/** Farther away, a saturated pixel changes a grey level at most: more than half
 * of the block of `best`, and of the mean of PartnerFit, px. */
constexpr int kClippedReach = 16;

/** Whether a pixel of @p seen has the value @p largest or more. */
template <typename Pixel>
bool
has_clipped (ImageView<const Pixel> seen, Pixel largest)
{
  for (int y = 0; y < seen.height; y++) {
    const Pixel *row = seen.row (y);
    /* A maximum, as compilers know it for vectors. */
    Pixel brightest = 0;
    for (int x = 0; x < seen.width; x++)
      brightest = std::max (brightest, row[x]);
    if (brightest >= largest)
      return true;
  }
  return false;
}

/** A plane of bytes, row by row without padding: 1 where one of @p marks is
 * within kClippedReach in both directions. */
std::vector<std::uint8_t> near_marks (
    std::vector<std::uint8_t> marks, int width, int height);

} // namespace codedexposure::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where a second camera has more light than it can tell. */
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/image.h"

namespace codedexposure::fuse
{

/** Farther away, a saturated pixel changes a grey level at most: more than half
 * of the block of `best`, and of the mean of PartnerFit, px. */
constexpr int kClippedReach = 16;

/* Along a line of @count values, @step apart. */
inline void
spread (std::uint8_t *line, int count, std::ptrdiff_t step)
{
  std::vector<int> last (static_cast<std::size_t> (count)); // marks before
  int mark = -kClippedReach - 1;
  for (int k = 0; k < count; k++)
    last[std::size_t (k)] = mark = line[k * step] != 0 ? k : mark;
  int next = count + kClippedReach;
  for (int k = count - 1; k >= 0; k--) {
    next = line[k * step] != 0 ? k : next;
    line[k * step] =
        k - last[std::size_t (k)] <= kClippedReach || next - k <= kClippedReach;
  }
}

/** A plane of bytes, row by row without padding: 1 where one of @p marks is
 * within kClippedReach in both directions. */
inline std::vector<std::uint8_t>
near_marks (std::vector<std::uint8_t> marks, int width, int height)
{
  for (int y = 0; y < height; y++)
    spread (marks.data () + std::ptrdiff_t (y) * width, width, 1);
  for (int x = 0; x < width; x++)
    spread (marks.data () + x, height, width);
  return marks;
}

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

} // namespace codedexposure::fuse

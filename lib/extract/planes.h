/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where the subframes of one coded frame best lie in memory. */
#pragma once

#include <cstddef>

namespace codedexposure
{

/** Rows of subframes that start at multiples of this many bytes can be written
 * with non-temporal stores from the first pixel on. */
constexpr std::size_t kRowAlignment = 64;

/**
 * Bytes by which to move the start of subframe @p k up in its memory.
 *
 * A kernel writes the same place of all subframes at once. Where all of them
 * start at the same place of a 4 KiB page, as large allocations do, these
 * writes share one set of the first-level cache and evict each other. Three
 * lines from one subframe to the next use all 64 sets in turn.
 */
constexpr std::size_t
plane_stagger (int k)
{
  return std::size_t (k) * 192 % 4096;
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the background has where regions cover it. */
#pragma once

#include <cstdlib>
#include <vector>

#include "base/geometry.h"
#include "schedule/schedule.h"

namespace codedexposure::fuse
{

/** The shortest distance, a multiple of @p period, that leads from @p at out of
 * [from, to): to the left, or to the right if @p right. */
inline int
distance_out (int at, int from, int to, int period, bool right)
{
  return right ? ((to - 1 - at) / period + 1) * period
               : -((at - from) / period + 1) * period;
}

/** The nearest pixel of the same element, whole periods of the tile to one
 * side, that no region covers; the pixel itself if there is none. */
inline Offset
uncovered_pixel (const Schedule &schedule, Extent size, Offset at)
{
  const Tile &tile = schedule.tile ();
  const Rect frame{0, 0, size.width, size.height};
  Offset best = at;
  int shortest = size.width + size.height;
  for (const bool across : {true, false}) {
    for (const bool forward : {true, false}) {
      Offset place = at;
      while (frame.holds (place.x, place.y)) {
        const int i = schedule.region_at (place.x, place.y);
        const int away = std::abs (place.x - at.x) + std::abs (place.y - at.y);
        if (i < 0 && away < shortest) {
          shortest = away;
          best = place;
        }
        if (i < 0)
          break;
        const Rect &rect = schedule.regions ()[std::size_t (i)].rect;
        if (across)
          place.x += distance_out (
              place.x, rect.x, rect.right (), tile.period_x (), forward);
        else
          place.y += distance_out (
              place.y, rect.y, rect.bottom (), tile.period_y (), forward);
      }
    }
  }
  return best;
}

/** A pixel of the background that a region covers, and the pixel of the same
 * element that replaces it. */
struct Cover {
  Offset at, from;
};

/** Of all pixels of all regions, in a frame of @p size. */
inline std::vector<Cover>
find_covers (const Schedule &schedule, Extent size)
{
  std::vector<Cover> covers;
  for (const Region &region : schedule.regions ())
    for (int y = region.rect.y; y < region.rect.bottom (); y++)
      for (int x = region.rect.x; x < region.rect.right (); x++)
        covers.push_back ({{x, y}, uncovered_pixel (schedule, size, {x, y})});
  return covers;
}

} // namespace codedexposure::fuse

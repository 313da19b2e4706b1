/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/plane_image.h"

#include <algorithm>
#include <numeric>

#include "schedule/pilot.h"

namespace codedexposure
{

namespace
{

/** Index, along the rows of the tile, of the first pixel that the mask of
 * @p slot turns on; the size of the tile for a dark mask. */
int
first_pixel_on (const Schedule &schedule, int slot)
{
  const Tile &tile = schedule.tile ();
  const int pixels = tile.period_x () * tile.period_y ();
  for (int at = 0; at < pixels; at++) {
    if (schedule.on (at % tile.period_x (), at / tile.period_x (), slot))
      return at;
  }
  return pixels;
}

} // namespace

PlanePlan
plan_planes (const Schedule &schedule)
{
  std::vector<int> first;
  for (int slot = 0; slot < schedule.slots (); slot++)
    first.push_back (first_pixel_on (schedule, slot));
  std::vector<int> order (std::size_t (schedule.masks ()), 0);
  std::iota (order.begin (), order.end (), 0);
  std::stable_sort (order.begin (), order.end (), [&] (int a, int b) {
    return first[std::size_t (a % schedule.slots ())] <
           first[std::size_t (b % schedule.slots ())];
  });

  PlanePlan plan;
  plan.masks.resize (order.size ());
  for (int place = 0; place < int (order.size ()); place++)
    plan.masks[std::size_t (order[std::size_t (place)])] = {
        place / kPlanesPerImage, place % kPlanesPerImage};
  plan.images = (int (order.size ()) + kPlanesPerImage - 1) / kPlanesPerImage;
  return plan;
}

std::vector<int>
PlanePlan::of_image (int image) const
{
  std::vector<int> found (kPlanesPerImage, -1);
  for (std::size_t mask = 0; mask < masks.size (); mask++)
    if (masks[mask].image == image)
      found[std::size_t (masks[mask].plane)] = int (mask);
  return found;
}

PlaneDigest
digest_mask (const Schedule &schedule, int mask)
{
  // One period of the tile, the pilot's columns and the regions determine it.
  const Tile &tile = schedule.tile ();
  const int slot = mask % schedule.slots ();
  const int own = schedule.mask_of (schedule.code (), slot);
  std::vector<std::uint64_t> words{std::uint64_t (tile.period_x ()),
      std::uint64_t (tile.period_y ()), std::uint64_t (schedule.pilot_rows ())};
  for (int y = 0; y < tile.period_y (); y++)
    for (int x = 0; x < tile.period_x (); x++)
      words.push_back (schedule.code ().on (schedule.element_at (x, y), own));
  if (schedule.pilot_rows () > 0)
    for (int column = 0; column < kPilotColumns; column++)
      words.push_back (pilot_on (column, mask, schedule.slots ()));
  for (int i = 0; i < int (schedule.regions ().size ()); i++) {
    const Schedule &region = schedule.region (i);
    const Rect &rect = schedule.regions ()[std::size_t (i)].rect;
    const PlaneDigest part =
        digest_mask (region, schedule.mask_of (region.code (), slot));
    for (const int side : {rect.x, rect.y, rect.width, rect.height})
      words.push_back (std::uint64_t (side));
    words.push_back (part.high);
    words.push_back (part.low);
  }

  // Two FNV-1a sums with different primes.
  PlaneDigest sum{0xcbf29ce484222325u, 0x9ae16a3b2f90404fu};
  for (const std::uint64_t word : words) {
    sum.high = (sum.high ^ word) * 0x100000001b3u;
    sum.low = (sum.low ^ word) * 0xc6a4a7935bd1e995u;
    sum.low ^= sum.low >> 32;
  }
  return sum;
}

} // namespace codedexposure

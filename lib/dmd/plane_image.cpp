/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/plane_image.h"

#include <algorithm>
#include <numeric>

#include "schedule/pilot.h"

namespace codedexposure
{

namespace
{

/** Place, along the rows of the tile, of the first pixel that the mask of
 * @p slot opens; the size of the tile for a dark mask. */
int
first_open_pixel (const Schedule &schedule, int slot)
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
    first.push_back (first_open_pixel (schedule, slot));
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
digest (ImageView<const PlanePixel> image)
{
  // Two FNV-1a sums over pixels with different primes.
  PlaneDigest sum{0xcbf29ce484222325u, 0x9ae16a3b2f90404fu};
  const auto mix = [&] (std::uint64_t value) {
    sum.high = (sum.high ^ value) * 0x100000001b3u;
    sum.low = (sum.low ^ value) * 0xc6a4a7935bd1e995u;
    sum.low ^= sum.low >> 32;
  };
  mix (std::uint64_t (image.width) << 32 | std::uint64_t (image.height));
  for (int y = 0; y < image.height; y++)
    for (int x = 0; x < image.width; x++)
      mix (image.row (y)[x]);
  return sum;
}

namespace
{

/** Of a mask of digest @p sum in which a region shows one of digest @p part. */
PlaneDigest
joined (const PlaneDigest &sum, const Rect &rect, const PlaneDigest &part)
{
  const std::uint64_t words[] = {sum.high, sum.low, part.high, part.low,
      std::uint64_t (rect.x) << 32 | std::uint64_t (rect.y),
      std::uint64_t (rect.width) << 32 | std::uint64_t (rect.height)};
  PlaneImage image (2 * int (std::size (words)), 1);
  for (int i = 0; i < image.width (); i++)
    image.at (i, 0) = PlanePixel (words[i / 2] >> (i % 2 * 32));
  return digest (image.view ());
}

} // namespace

PlaneDigest
digest_mask (const Schedule &schedule, int mask)
{
  // One period of each tile and the pilot's columns say everything.
  const Tile &tile = schedule.tile ();
  const int width = tile.period_x (), height = tile.period_y ();
  const int slot = mask % schedule.slots ();
  const int own = schedule.mask_of (schedule.code (), slot);
  PlaneImage period (width + kPilotColumns + 1, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      period.at (x, y) = schedule.code ().on (schedule.element_at (x, y), own);
  period.at (width, 0) = PlanePixel (schedule.pilot_rows ());
  if (schedule.pilot_rows () > 0)
    for (int column = 0; column < kPilotColumns; column++)
      period.at (width + 1 + column, 0) =
          pilot_on (column, mask, schedule.slots ());

  PlaneDigest sum = digest (period.view ());
  for (int i = 0; i < int (schedule.regions ().size ()); i++) {
    const Schedule &region = schedule.region (i);
    sum = joined (sum, schedule.regions ()[std::size_t (i)].rect,
        digest_mask (region, schedule.mask_of (region.code (), slot)));
  }
  return sum;
}

} // namespace codedexposure

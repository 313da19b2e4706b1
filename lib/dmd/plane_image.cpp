/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/plane_image.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "schedule/pilot.h"

namespace cexp
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
    const int element =
        schedule.element_at (at % tile.period_x (), at / tile.period_x ());
    if (schedule.code ().open (element, slot))
      return at;
  }
  return pixels;
}

/** Planes of each element, by label of its pixels, and of the pilot's columns.
 */
class PixelTable
{
public:
  PixelTable (const Schedule &schedule, const std::vector<int> &masks)
      : elements_ (std::size_t (schedule.elements ()), 0)
  {
    for (std::size_t plane = 0; plane < masks.size (); plane++) {
      const int slot = masks[plane] % schedule.slots ();
      for (int e = 0; e < schedule.elements (); e++)
        if (schedule.code ().open (e, slot))
          elements_[std::size_t (e)] |= PlanePixel (1) << plane;
      for (int column = 0; column < kPilotColumns; column++)
        if (pilot_open (column, masks[plane], schedule.slots ()))
          pilot_[std::size_t (column)] |= PlanePixel (1) << plane;
    }
  }

  PlanePixel element (int e) const { return elements_[std::size_t (e)]; }
  PlanePixel pilot (int column) const
  {
    return pilot_[std::size_t (column % kPilotColumns)];
  }

private:
  std::vector<PlanePixel> elements_;
  std::array<PlanePixel, kPilotColumns> pilot_{};
};

void
fill_planes (const Schedule &schedule, const PixelTable &table,
    const Placement &placement, PlaneImage &image)
{
  const MirrorRegion region = placement.region.value_or (
      MirrorRegion{{image.width (), image.height ()}, {}});
  const int pilot_top =
      std::max (0, region.size.height - schedule.pilot_rows ());
  for (int y = 0; y < region.size.height; y++) {
    PlanePixel *row = image.view ().row (region.origin.y + y) + region.origin.x;
    for (int x = 0; x < region.size.width; x++) {
      const Offset pixel = tile_pixel (placement.layout, x, y);
      row[x] = y < pilot_top
                   ? table.element (schedule.element_at (pixel.x, pixel.y))
                   : table.pilot (x);
    }
  }
}

} // namespace

std::vector<int>
plane_order (const Schedule &schedule)
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
  return order;
}

PlaneSet
render_planes (
    const Schedule &schedule, const Placement &placement, Extent size)
{
  const std::vector<int> order = plane_order (schedule);
  PlaneSet set;
  set.masks.resize (order.size ());
  for (std::size_t first = 0; first < order.size (); first += kPlanesPerImage) {
    const std::size_t last = std::min (order.size (), first + kPlanesPerImage);
    const std::vector<int> masks (order.begin () + std::ptrdiff_t (first),
        order.begin () + std::ptrdiff_t (last));
    for (std::size_t plane = 0; plane < masks.size (); plane++)
      set.masks[std::size_t (masks[plane])] = {
          int (set.images.size ()), int (plane)};
    PlaneImage &image = set.images.emplace_back (size.width, size.height);
    fill_planes (schedule, PixelTable (schedule, masks), placement, image);
  }
  return set;
}

ImageView<const PlanePixel>
columns (ImageView<const PlanePixel> image, int x, int width)
{
  return {image.data + x, width, image.height, image.stride};
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

} // namespace cexp

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/mask_renderer.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "schedule/pilot.h"

namespace codedexposure
{

namespace
{

/* Keys of rows that show no code; others have two numbers at least. */
const std::vector<int> kOffKey, kPilotKey{0};

Rect
region_of (const Placement &placement, Extent size)
{
  return placement.region.value_or (Rect{0, 0, size.width, size.height});
}

} // namespace

template <typename Mirror>
Image<Mirror>
MirrorRows<Mirror>::image () const
{
  Image<Mirror> image (width (), height ());
  for (int y = 0; y < height (); y++)
    std::copy_n (row (y), width (), image.view ().row (y));
  return image;
}

MaskRenderer::MaskRenderer (
    const Schedule &schedule, Extent size, const Placement &placement)
    : map_ (schedule)
{
  const Rect region = region_of (placement, size);
  const int pilot = pilot_top (schedule, placement.layout, region.height);

  std::map<std::vector<int>, int> known;
  std::vector<int> rows; // of the region, for each distinct row
  for (int y = 0; y < size.height; y++) {
    const int row = y - region.y;
    const std::vector<int> key = row < 0 || row >= region.height ? kOffKey
                                 : row >= pilot                  ? kPilotKey
                                                : row_key (placement, row);
    const auto [at, is_new] = known.try_emplace (key, int (rows.size ()));
    if (is_new)
      rows.push_back (row);
    shown_.order.push_back (at->second);
  }
  shown_.distinct = Image<Shown> (size.width, int (rows.size ()));
  for (int i = 0; i < int (rows.size ()); i++)
    fill_row (placement, region, rows[std::size_t (i)],
        shown_.distinct.view ().row (i));
}

/** What two rows of the region have in common if and only if they show the same
 * elements. */
std::vector<int>
MaskRenderer::row_key (const Placement &placement, int row) const
{
  const Offset start =
      tile_pixel (placement.layout, 0, row, placement.odd_rows_left);
  const std::vector<Region> &regions = schedule ().regions ();
  std::vector<int> key;
  const auto add_place = [&key] (const Tile &tile, int x, int y) {
    key.push_back (floor_mod (x, tile.period_x ()));
    key.push_back (floor_mod (y, tile.period_y ()));
  };
  add_place (schedule ().tile (), start.x, start.y);
  if (placement.layout == MirrorLayout::lattice && !regions.empty ()) {
    /* Rows cross the regions at an angle: each is its own. */
    key.push_back (row);
    return key;
  }
  for (int i = 0; i < int (regions.size ()); i++) {
    const auto &[rect, tile, code, order, phase] = regions[std::size_t (i)];
    if (start.y < rect.y || start.y >= rect.bottom ())
      continue;
    key.push_back (i);
    add_place (tile, start.x - rect.x, start.y - rect.y);
  }
  return key;
}

void
MaskRenderer::fill_row (
    const Placement &placement, const Rect &region, int row, Shown *shown) const
{
  const int elements = map_.elements ();
  const int nothing = elements + kPilotColumns;
  std::fill_n (shown, shown_.distinct.width (), Shown (nothing));
  if (row < 0 || row >= region.height)
    return;
  const int pilot = pilot_top (schedule (), placement.layout, region.height);
  shown += region.x;
  for (int x = 0; x < region.width; x++) {
    const Offset pixel =
        tile_pixel (placement.layout, x, row, placement.odd_rows_left);
    shown[x] = Shown (row < pilot ? map_.at (pixel.x, pixel.y)
                                  : elements + x % kPilotColumns);
  }
}

template <typename Mirror>
MirrorRows<Mirror>
MaskRenderer::render (std::span<const int> masks) const
{
  const int slots = schedule ().slots ();
  const int elements = map_.elements ();
  std::vector<Mirror> mirrors (std::size_t (elements + kPilotColumns + 1));
  for (std::size_t i = 0; i < masks.size (); i++) {
    const Mirror bit = Mirror (Mirror (1) << i);
    const int mask = masks[i];
    for (int e = 0; mask >= 0 && e < elements; e++)
      if (map_.on (e, mask % slots))
        mirrors[std::size_t (e)] |= bit;
    for (int column = 0; mask >= 0 && column < kPilotColumns; column++)
      if (pilot_on (column, mask, slots) != schedule ().pilot_inverted ())
        mirrors[std::size_t (elements + column)] |= bit;
  }

  MirrorRows<Mirror> rows{
      Image<Mirror> (shown_.width (), shown_.distinct.height ()), shown_.order};
  for (int y = 0; y < rows.distinct.height (); y++) {
    const Shown *shown = shown_.distinct.view ().row (y);
    std::transform (shown, shown + shown_.width (),
        rows.distinct.view ().row (y),
        [&mirrors] (Shown what) { return mirrors[what]; });
  }
  return rows;
}

template <typename Mirror>
MirrorRows<Mirror>
render_still (const StillMask &mask, Extent size, const Placement &placement)
{
  MirrorRows<Mirror> rows{Image<Mirror> (size.width, size.height),
      std::vector<int> (std::size_t (size.height))};
  std::iota (rows.order.begin (), rows.order.end (), 0);
  const Rect region = region_of (placement, size);
  for (int y = 0; y < region.height; y++) {
    Mirror *row = rows.distinct.view ().row (region.y + y) + region.x;
    for (int x = 0; x < region.width; x++) {
      const Offset pixel =
          tile_pixel (placement.layout, x, y, placement.odd_rows_left);
      row[x] = mask.on (pixel.x, pixel.y);
    }
  }
  return rows;
}

template struct MirrorRows<std::uint8_t>;
template struct MirrorRows<std::uint32_t>;
template MirrorRows<std::uint8_t> MaskRenderer::render (
    std::span<const int> masks) const;
template MirrorRows<std::uint32_t> MaskRenderer::render (
    std::span<const int> masks) const;
template MirrorRows<std::uint8_t> render_still (
    const StillMask &mask, Extent size, const Placement &placement);
template MirrorRows<std::uint32_t> render_still (
    const StillMask &mask, Extent size, const Placement &placement);

} // namespace codedexposure

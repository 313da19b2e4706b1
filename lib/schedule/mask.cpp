/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include <algorithm>

#include "schedule/pilot.h"
#include "schedule/schedule.h"

namespace cexp
{

namespace
{

/** Fills rows that repeat after @p period pixels either way: only one period is
 * asked for, the rest is copied. */
template <typename Open>
void
fill_periodic (ImageView<std::uint8_t> out, Extent period, Open open)
{
  for (int y = 0; y < out.height; y++) {
    std::uint8_t *row = out.row (y);
    if (y >= period.height) {
      std::copy_n (out.row (y - period.height), out.width, row);
      continue;
    }
    for (int x = 0; x < out.width; x++)
      row[x] = x < period.width ? open (x, y) : row[x - period.width];
  }
}

void
render_part (const Schedule &part, int slot, ImageView<std::uint8_t> out)
{
  const Tile &tile = part.tile ();
  fill_periodic (out, {tile.period_x (), tile.period_y ()}, [&] (int x, int y) {
    return part.code ().open (part.element_at (x, y), slot);
  });
}

/** The pixels of @p rect that @p out has. */
ImageView<std::uint8_t>
within (ImageView<std::uint8_t> out, const Rect &rect)
{
  const int x = std::min (rect.x, out.width);
  const int y = std::min (rect.y, out.height);
  return out.block (x, y, std::min (rect.width, out.width - x),
      std::min (rect.height, out.height - y));
}

} // namespace

void
render_mask (const Schedule &schedule, int mask, ImageView<std::uint8_t> out)
{
  const int slots = schedule.slots ();
  const int slot = mask % slots;
  const int pilot_top = std::max (0, out.height - schedule.pilot_rows ());

  const ImageView<std::uint8_t> code = out.rows (0, pilot_top);
  render_part (schedule, schedule.mask_of (schedule.code (), slot), code);
  for (int i = 0; i < int (schedule.regions ().size ()); i++)
    render_part (schedule.region (i),
        schedule.mask_of (schedule.region (i).code (), slot),
        within (code, schedule.regions ()[std::size_t (i)].rect));
  fill_periodic (out.rows (pilot_top, out.height - pilot_top),
      {kPilotColumns, 1},
      [&] (int x, int) { return pilot_open (x, mask, slots); });
}

} // namespace cexp

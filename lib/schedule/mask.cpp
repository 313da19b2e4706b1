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

} // namespace

void
render_mask (const Schedule &schedule, int mask, ImageView<std::uint8_t> out)
{
  const int slots = schedule.slots ();
  const int slot = mask % slots;
  const Tile &tile = schedule.tile ();
  const int pilot_top = std::max (0, out.height - schedule.pilot_rows ());

  fill_periodic (out.rows (0, pilot_top), {tile.period_x (), tile.period_y ()},
      [&] (int x, int y) {
        return schedule.code ().open (schedule.element_at (x, y), slot);
      });
  fill_periodic (out.rows (pilot_top, out.height - pilot_top),
      {kPilotColumns, 1},
      [&] (int x, int) { return pilot_open (x, mask, slots); });
}

} // namespace cexp

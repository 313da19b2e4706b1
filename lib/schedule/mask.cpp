/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include <algorithm>

#include "schedule/pilot.h"
#include "schedule/schedule.h"

namespace cexp
{

void
render_mask (const Schedule &schedule, int mask, ImageView<std::uint8_t> out)
{
  const int slots = schedule.slots ();
  const int slot = mask % slots;
  const int pilot_top = std::max (0, out.height - schedule.pilot_rows ());

  for (int y = 0; y < pilot_top; y++) {
    std::uint8_t *row = out.row (y);
    for (int x = 0; x < out.width; x++)
      row[x] = schedule.code ().open (schedule.element_at (x, y), slot);
  }
  for (int y = pilot_top; y < out.height; y++) {
    std::uint8_t *row = out.row (y);
    for (int x = 0; x < out.width; x++)
      row[x] = pilot_open (x, mask, slots);
  }
}

} // namespace cexp

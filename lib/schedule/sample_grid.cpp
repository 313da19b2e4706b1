/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/sample_grid.h"

#include <algorithm>

namespace codedexposure
{

SampleGrid::SampleGrid (const Schedule &schedule)
    : elements_ (schedule.elements ()), pilot_rows_ (schedule.pilot_rows ()),
      cell_ (schedule.cell ())
{
  const Tile &tile = schedule.tile ();
  repeat_ = {tile.period_x () / cell_.width, tile.period_y () / cell_.height};
  offsets_.resize (std::size_t (repeat_.width * repeat_.height * elements_));

  for (int y = 0; y < repeat_.height * cell_.height; y++) {
    for (int x = 0; x < repeat_.width * cell_.width; x++) {
      const int at = (y / cell_.height) * repeat_.width + x / cell_.width;
      const int element = schedule.element_at (x, y);
      offsets_[std::size_t (at * elements_ + element)] = {
          x % cell_.width, y % cell_.height};
    }
  }
}

Extent
SampleGrid::subframe_size (int coded_width, int coded_height) const
{
  return {coded_width / cell_.width,
      std::max (0, coded_height - pilot_rows_) / cell_.height};
}

} // namespace codedexposure

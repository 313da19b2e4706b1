/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The mirrors of the mask that stands, row by row. */
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/image.h"
#include "schedule/schedule.h"
#include "schedule/still_mask.h"

namespace cexp
{

/**
 * What render_mask () gives, but made once per mask for one period of the tile
 * only, so that a change of mask costs little at any size; with regions, whose
 * rows do not repeat, for all rows.
 */
class MirrorRows
{
public:
  MirrorRows (Schedule schedule, int width, int height);

  const Schedule &schedule () const { return schedule_; }
  /** What kStillMask shows from now on; may be null where nobody asks for it.
   */
  void hold (std::shared_ptr<const StillMask> mask);
  /** @p mask: index in 0..masks () - 1, or kStillMask; a negative one shuts
   * every mirror. */
  void show (int mask);
  /** The mirrors of row @p y, one byte each, 1 on and 0 off. */
  const std::uint8_t *row (int y) const
  {
    if (shown_ == kStillMask)
      return still_.view ().row (y);
    return mirrors_.view ().row (y < pilot_top_ ? y % rows_ : rows_);
  }

private:
  void show_code (int slot);

  Schedule schedule_;
  Extent size_;
  int rows_;                     // one period of the tile, or all
  int pilot_top_;                // all where rows_ holds the pilot, too
  Image<std::uint8_t> elements_; // of a period
  Image<std::uint8_t> mirrors_;  // of rows_ and, last, of the pilot
  std::shared_ptr<const StillMask> held_;
  Image<std::uint8_t> still_;
  int shown_;
};

} // namespace cexp

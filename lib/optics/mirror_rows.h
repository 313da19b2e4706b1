/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The mirrors of the mask that stands, row by row. */
#pragma once

#include <cstdint>
#include <vector>

#include "base/image.h"
#include "schedule/schedule.h"

namespace cexp
{

/**
 * What render_mask () gives, but made once per mask for one period of the tile
 * only, so that a change of mask costs little at any size.
 */
class MirrorRows
{
public:
  MirrorRows (Schedule schedule, int width, int height);

  const Schedule &schedule () const { return schedule_; }
  /** @p mask: index in 0..masks () - 1; a negative one parks the mirrors. */
  void show (int mask);
  /** The mirrors of row @p y, one byte each, 1 on and 0 off. */
  const std::uint8_t *row (int y) const
  {
    return mirrors_.view ().row (
        y < pilot_top_ ? y % elements_.height () : elements_.height ());
  }

private:
  Schedule schedule_;
  int pilot_top_;
  Image<std::uint8_t> elements_; // one period of rows
  Image<std::uint8_t> mirrors_;  // the same and, last, a row of the pilot
  int shown_;
};

} // namespace cexp

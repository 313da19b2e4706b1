/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Which element of which part of a schedule each pixel is. */
#pragma once

#include <vector>

#include "schedule/schedule.h"

namespace codedexposure
{

/**
 * The elements of all parts of a schedule under one set of numbers: first those
 * of the background, then those of each region. Elements that are on in the
 * same slots have the same number. Slots are those of the whole exposure.
 */
class ElementMap
{
public:
  explicit ElementMap (const Schedule &schedule);

  const Schedule &schedule () const { return schedule_; }
  int elements () const { return int (on_.size ()); }

  /** Parts: the background is 0, region i is i + 1. */
  int parts () const { return int (parts_.size ()); }
  /** A part as a schedule of its own. */
  const Schedule &part (int part) const { return parts_[std::size_t (part)]; }
  /** Where its tile begins. */
  Offset corner (int part) const;
  int part_at (int x, int y) const { return schedule_.region_at (x, y) + 1; }

  /** Element of pixel (@p x, @p y), pilot or not. */
  int at (int x, int y) const { return at (part_at (x, y), x, y); }
  /** The same if @p part were all there is. */
  int at (int part, int x, int y) const
  {
    const Offset from = corner (part);
    return numbers_[std::size_t (part)][std::size_t (
        this->part (part).element_at (x - from.x, y - from.y))];
  }

  bool on (int element, int slot) const
  {
    return on_[std::size_t (element)][std::size_t (slot)];
  }
  /** Light that an element lets through, as Schedule::light (). */
  double light (int element, int slot) const
  {
    return on (element, slot) ? 1.0 : schedule_.leak ();
  }
  double light (int element) const;

private:
  Schedule schedule_;
  std::vector<Schedule> parts_;
  std::vector<std::vector<int>> numbers_; ///< of each part's elements
  std::vector<std::vector<bool>> on_;     ///< each element in each slot
};

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Which element of which part of a schedule each pixel is. */
#pragma once

#include <vector>

#include "schedule/schedule.h"

namespace codedexposure
{

/**
 * The elements of all parts of a schedule under one set of numbers: first those
 * of the background, then those of each region. Slots are those of the whole
 * exposure.
 */
class ElementMap
{
public:
  explicit ElementMap (const Schedule &schedule);

  const Schedule &schedule () const { return schedule_; }
  int elements () const { return int (own_.size ()); }

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
    return firsts_[std::size_t (part)] +
           this->part (part).element_at (x - from.x, y - from.y);
  }

  bool on (int element, int slot) const
  {
    const Own &own = own_[std::size_t (element)];
    const Code &code = part (own.part).code ();
    return code.on (own.element, schedule_.mask_of (code, slot));
  }
  /** Light that an element lets through, as Schedule::light (). */
  double light (int element, int slot) const;
  double light (int element) const;

private:
  struct Own {
    int part;
    int element; // of the part
  };

  Schedule schedule_;
  std::vector<Schedule> parts_;
  std::vector<int> firsts_; // number of each part's element 0
  std::vector<Own> own_;
};

} // namespace codedexposure

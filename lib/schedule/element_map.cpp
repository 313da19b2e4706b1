/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/element_map.h"

namespace codedexposure
{

ElementMap::ElementMap (const Schedule &schedule) : schedule_ (schedule)
{
  parts_.push_back (schedule.background ());
  for (int i = 0; i < int (schedule.regions ().size ()); i++)
    parts_.push_back (schedule.region (i));
  for (int i = 0; i < parts (); i++) {
    firsts_.push_back (elements ());
    for (int e = 0; e < part (i).elements (); e++)
      own_.push_back ({i, e});
  }
}

Offset
ElementMap::corner (int part) const
{
  if (part == 0)
    return {};
  const Rect &rect = schedule_.regions ()[std::size_t (part) - 1].rect;
  return {rect.x, rect.y};
}

double
ElementMap::light (int element, int slot) const
{
  const auto &[part, own] = own_[std::size_t (element)];
  const Schedule &schedule = this->part (part);
  return schedule.light (own, schedule_.mask_of (schedule.code (), slot));
}

double
ElementMap::light (int element) const
{
  const auto &[part, own] = own_[std::size_t (element)];
  const Code &code = this->part (part).code ();
  const int held = schedule_.slots () / code.slots ();
  return schedule_.light_of (code.on_slots (own) * held);
}

} // namespace codedexposure

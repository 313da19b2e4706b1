/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/element_map.h"

#include <algorithm>
#include <map>

namespace codedexposure
{

ElementMap::ElementMap (const Schedule &schedule) : schedule_ (schedule)
{
  parts_.push_back (schedule.background ());
  for (int i = 0; i < int (schedule.regions ().size ()); i++)
    parts_.push_back (schedule.region (i));
  std::map<std::vector<bool>, int> known;
  for (const Schedule &part : parts_) {
    std::vector<int> &numbers = numbers_.emplace_back ();
    for (int e = 0; e < part.elements (); e++) {
      std::vector<bool> on;
      for (int slot = 0; slot < schedule.slots (); slot++)
        on.push_back (
            part.code ().on (e, schedule.mask_of (part.code (), slot)));
      const auto [at, is_new] = known.try_emplace (on, elements ());
      if (is_new)
        on_.push_back (std::move (on));
      numbers.push_back (at->second);
    }
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
ElementMap::light (int element) const
{
  const std::vector<bool> &on = on_[std::size_t (element)];
  return schedule_.light_of (int (std::count (on.begin (), on.end (), true)));
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "rectify/elements.h"

#include <algorithm>

namespace codedexposure
{

Elements::Elements (const Schedule &schedule, Extent mirrors)
    : map_ (schedule), rects_{{0, 0, mirrors.width, mirrors.height}}
{
  for (const Region &region : schedule.regions ())
    rects_.push_back (region.rect);
  for (int e = 0; e < map_.elements (); e++)
    number (e);
}

/** Gives an element of the map the number of those that are on with it. */
void
Elements::number (int element)
{
  std::vector<double> light;
  for (int s = 0; s < slots (); s++)
    light.push_back (map_.light (element, s));
  const auto [at, is_new] = known_.try_emplace (light, int (light_.size ()));
  numbers_.push_back (at->second);
  if (!is_new)
    return;
  SlotShares &shares = shares_.emplace_back ();
  for (int s = 0; s < slots (); s++)
    if (light[std::size_t (s)] > 0.0)
      shares.push_back ({s, light[std::size_t (s)]});
  light_.push_back (map_.light (element));
}

int
Elements::part_at (int x, int y) const
{
  const Rect &all = rect (0);
  const int px = std::clamp (x, 0, all.width - 1);
  const int py = std::clamp (y, 0, all.height - 1);
  for (int i = 1; i < parts (); i++)
    if (rect (i).holds (px, py))
      return i;
  return 0;
}

double
Elements::most_light () const
{
  return *std::max_element (light_.begin (), light_.end ());
}

int
Elements::most_slots () const
{
  int most = 1;
  for (int i = 0; i < parts (); i++)
    most = std::max (most, map_.part (i).slots ());
  return most;
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "optics/mirror_rows.h"

#include <algorithm>
#include <array>

#include "schedule/pilot.h"

namespace cexp
{

namespace
{
constexpr int kParked = -1;
}

MirrorRows::MirrorRows (Schedule schedule, int width, int height)
    : schedule_ (std::move (schedule)),
      pilot_top_ (std::max (0, height - schedule_.pilot_rows ())),
      elements_ (width, schedule_.tile ().period_y ()),
      mirrors_ (width, schedule_.tile ().period_y () + 1), height_ (height),
      shown_ (kParked)
{
  for (int y = 0; y < elements_.height (); y++)
    for (int x = 0; x < width; x++)
      elements_.at (x, y) = std::uint8_t (schedule_.element_at (x, y));
}

void
MirrorRows::hold (std::shared_ptr<const StillMask> mask)
{
  if (mask == held_)
    return;
  held_ = std::move (mask);
  if (!held_)
    return;
  still_ = Image<std::uint8_t> (elements_.width (), height_);
  for (int y = 0; y < still_.height (); y++)
    for (int x = 0; x < still_.width (); x++)
      still_.at (x, y) = held_->open (x, y);
}

void
MirrorRows::show (int mask)
{
  mask = std::max (mask, kParked);
  if (mask == shown_)
    return;
  shown_ = mask;
  if (mask == kStillMask)
    return;

  const int slots = schedule_.slots ();
  std::array<std::uint8_t, Tile::kMaxElements> open = {};
  if (mask != kParked)
    for (int e = 0; e < schedule_.elements (); e++)
      open[std::size_t (e)] = schedule_.code ().open (e, mask % slots);

  const int width = elements_.width ();
  for (int y = 0; y < elements_.height (); y++) {
    const std::uint8_t *elements = elements_.view ().row (y);
    std::transform (elements, elements + width, mirrors_.view ().row (y),
        [&open] (std::uint8_t e) { return open[e]; });
  }
  std::uint8_t *pilot = mirrors_.view ().row (elements_.height ());
  for (int x = 0; x < width; x++)
    pilot[x] = mask != kParked && pilot_open (x, mask, slots);
}

} // namespace cexp

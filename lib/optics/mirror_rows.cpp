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
    : schedule_ (std::move (schedule)), size_{width, height}, rows_ (height),
      pilot_top_ (height), shown_ (kParked)
{
  if (schedule_.regions ().empty ()) {
    rows_ = schedule_.tile ().period_y ();
    pilot_top_ = std::max (0, height - schedule_.pilot_rows ());
    elements_ = Image<std::uint8_t> (width, rows_);
  }
  mirrors_ = Image<std::uint8_t> (width, rows_ + 1);
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
  still_ = Image<std::uint8_t> (size_.width, size_.height);
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

  const ImageView<std::uint8_t> mirrors = mirrors_.view ();
  if (mask == kParked) {
    for (int y = 0; y < mirrors.height; y++)
      std::fill_n (mirrors.row (y), mirrors.width, std::uint8_t (0));
    return;
  }
  if (!schedule_.regions ().empty ())
    return render_mask (schedule_, mask, mirrors.rows (0, rows_));

  const int slots = schedule_.slots ();
  show_code (mask % slots);
  for (int x = 0; x < mirrors.width; x++)
    mirrors.at (x, rows_) = pilot_open (x, mask, slots);
}

void
MirrorRows::show_code (int slot)
{
  std::array<std::uint8_t, Tile::kMaxElements> open = {};
  for (int e = 0; e < schedule_.elements (); e++)
    open[std::size_t (e)] = schedule_.code ().open (e, slot);
  for (int y = 0; y < rows_; y++) {
    const std::uint8_t *elements = elements_.view ().row (y);
    std::transform (elements, elements + size_.width, mirrors_.view ().row (y),
        [&open] (std::uint8_t e) { return open[e]; });
  }
}

} // namespace cexp

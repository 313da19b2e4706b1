/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "moire/rectify_elements.h"

#include <algorithm>
#include <cmath>

namespace cexp
{

namespace
{

/* Elements of which all pairs are kept. */
constexpr std::size_t kFew = 512;

} // namespace

Elements::Elements (
    const Schedule &schedule, Extent mirrors, double persistence)
{
  add_part (schedule, -1, {0, 0, mirrors.width, mirrors.height});
  for (std::size_t i = 0; i < schedule.regions ().size (); i++)
    add_part (schedule, int (i), schedule.regions ()[i].rect);

  int fastest = 1;
  for (const Part &part : parts_)
    fastest = std::max (fastest, part.schedule.slots ());
  const std::size_t slots = std::size_t (schedule.slots ());
  const double a_slot_later =
      std::pow (persistence, double (fastest) / schedule.slots ());
  std::vector<double> alike;
  for (std::size_t s = 0; s < slots; s++)
    alike.push_back (std::pow (a_slot_later, s));
  for (const Openness &open : open_) {
    Openness &later = later_.emplace_back (slots);
    for (std::size_t s = 0; s < slots; s++)
      for (std::size_t t = 0; t < slots; t++)
        later[s] += open[t] * alike[s > t ? s - t : t - s];
  }
  const int count = int (open_.size ());
  for (int e = 0; e < count && open_.size () <= kFew; e++)
    for (int f = 0; f < count; f++)
      covariances_.push_back (covariance_of (e, f));
}

void
Elements::add_part (const Schedule &whole, int region, const Rect &rect)
{
  Part part{region < 0 ? whole.background () : whole.region (region), rect, {}};
  const Code &code = part.schedule.code ();
  const int held = whole.slots () / code.slots ();
  for (int e = 0; e < code.elements (); e++) {
    Openness open;
    for (int s = 0; s < whole.slots (); s++)
      open.push_back (
          code.open (e, whole.mask_of (code, s)) ? 1.0 : whole.leak ());
    const auto [at, is_new] = known_.try_emplace (open, int (open_.size ()));
    part.numbers.push_back (at->second);
    if (!is_new)
      continue;
    open_.push_back (std::move (open));
    const int slots = code.open_slots (e) * held;
    light_.push_back (slots + whole.leak () * (whole.slots () - slots));
  }
  parts_.push_back (std::move (part));
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

int
Elements::at (int part, int x, int y) const
{
  const auto &[schedule, rect, numbers] = get (part);
  return numbers[std::size_t (schedule.element_at (x - rect.x, y - rect.y))];
}

double
Elements::most_light () const
{
  return *std::max_element (light_.begin (), light_.end ());
}

double
Elements::covariance_of (int e, int f) const
{
  const Openness &open = open_[std::size_t (e)];
  const Openness &later = later_[std::size_t (f)];
  double sum = 0.0;
  for (std::size_t s = 0; s < open.size (); s++)
    sum += open[s] * later[s];
  return sum;
}

} // namespace cexp

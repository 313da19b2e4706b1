/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/schedule.h"

#include <algorithm>
#include <numeric>

#include "base/text.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

Result<void>
check_order (const std::vector<int> &order, int elements)
{
  const std::string what = "order with " + std::to_string (order.size ()) +
                           " entries for " + std::to_string (elements) +
                           " labels";
  if (order.size () != std::size_t (elements))
    return Error{what + "; it names the element of each label once"};

  std::vector<bool> seen (order.size ());
  for (const int element : order) {
    if (element < 0 || element >= elements)
      return Error{what + " names element " + std::to_string (element) +
                   "; elements are 0.." + std::to_string (elements - 1)};
    if (seen[std::size_t (element)])
      return Error{what + " names element " + std::to_string (element) +
                   " twice; it must be a permutation"};
    seen[std::size_t (element)] = true;
  }
  return {};
}

Result<void>
check_time (const char *name, Nanoseconds time)
{
  if (time < 0 || time >= kTimeLimit)
    return Error{std::string (name) + " of " + std::to_string (time) +
                 " ns: it must not be negative and must be below an hour"};
  return {};
}

Result<void>
check_numbers (const Schedule::Parts &parts)
{
  const Timing &timing = parts.timing;
  for (const auto &[name, time] : {std::pair ("active", timing.active),
           std::pair ("switching", timing.switching),
           std::pair ("readout", timing.readout)})
    RETURN_IF_ERROR (check_time (name, time));

  if (!(parts.leak >= 0.0 && parts.leak <= Schedule::kMaxLeak))
    return Error{"leak " + real_text (parts.leak) +
                 ": the light of a mirror that is off as a part of one that is "
                 "on must lie in 0..0.5"};
  for (const int shift : {parts.phase.x, parts.phase.y})
    if (shift < 0 || shift > Schedule::kMaxMirrors)
      return Error{"phase " + std::to_string (parts.phase.x) + "/" +
                   std::to_string (parts.phase.y) + ": each must lie in 0.." +
                   std::to_string (Schedule::kMaxMirrors)};
  if (parts.pilot_rows < 0 || parts.pilot_rows > Schedule::kMaxMirrors)
    return Error{"pilot of " + std::to_string (parts.pilot_rows) +
                 " rows: it must lie in 0.." +
                 std::to_string (Schedule::kMaxMirrors)};
  return {};
}

/** sequential:2x2. It can fail only for lack of memory. */
Schedule::Parts
default_parts ()
{
  auto tile = Tile::raster (2, 2);
  auto code = Code::named ("sequential", 4);
  if (!tile || !code)
    throw std::bad_alloc ();
  Schedule::Parts parts{*std::move (tile), *std::move (code)};
  parts.order = {0, 1, 2, 3};
  return parts;
}

Error
in_region (std::size_t i, const Rect &rect, const std::string &why)
{
  return {
      "region " + std::to_string (i) + ", " + rect_text (rect) + ": " + why};
}

Result<void>
check_rect (const Rect &rect, Extent cell)
{
  for (const int place : {rect.x, rect.y, rect.width, rect.height})
    if (place < 0 || place > Schedule::kMaxMirrors)
      return Error{"corner and size must lie in 0.." +
                   std::to_string (Schedule::kMaxMirrors)};
  if (rect.width < 1 || rect.height < 1)
    return Error{"it holds no pixel; give it a width and a height"};
  if (rect.width % cell.width != 0 || rect.height % cell.height != 0)
    return Error{"its sides must be multiples of those of its cell, " +
                 size_text (cell)};
  return {};
}

} // namespace

Schedule::Schedule (Parts parts, Extent cell)
    : parts_ (std::move (parts)), cell_ (cell), slots_ (parts_.code.slots ())
{
  white_slots_ = light_of (parts_.code.max_on_slots ());
}

Schedule::Schedule () : Schedule (default_parts (), {2, 2}) {}

Result<Schedule>
Schedule::make (Parts parts)
try {
  const int elements = parts.tile.elements ();
  if (parts.code.elements () != elements)
    return Error{"code '" + parts.code.name () + "' has " +
                 std::to_string (parts.code.elements ()) +
                 " elements and tile '" + parts.tile.name () + "' has " +
                 std::to_string (elements) + "; they must have as many"};
  if (parts.order.empty ()) {
    parts.order.resize (std::size_t (elements));
    std::iota (parts.order.begin (), parts.order.end (), 0);
  }
  RETURN_IF_ERROR (check_order (parts.order, elements));
  RETURN_IF_ERROR (check_numbers (parts));

  ASSIGN_OR_RETURN (const auto cell, parts.tile.cell (parts.phase));
  Schedule schedule (std::move (parts), cell);
  RETURN_IF_ERROR (schedule.add_regions ());
  if (!schedule.regions ().empty () &&
      schedule.to_json ().size () > kMaxJsonSize)
    return Error{"tiles and codes of the regions take more than " +
                 std::to_string (kMaxJsonSize) +
                 " bytes to write out; name them, or take fewer"};
  return schedule;
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

/** Makes and checks the parts that regions are, and counts the slots. */
Result<void>
Schedule::add_regions ()
{
  std::vector<Region> &regions = parts_.regions;
  if (regions.size () > std::size_t (kMaxRegions))
    return Error{std::to_string (regions.size ()) +
                 " regions: " + std::to_string (kMaxRegions) + " are possible"};
  for (std::size_t i = 0; i < regions.size (); i++) {
    auto &[rect, tile, code, order, phase] = regions[i];
    auto part = make ({tile, code, {}, order, phase, parts_.leak});
    if (!part)
      return in_region (i, rect, part.error ().message);
    if (const auto checked = check_rect (rect, part->cell ()); !checked)
      return in_region (i, rect, checked.error ().message);
    for (std::size_t other = 0; other < i; other++)
      if (rect.meets (regions[other].rect))
        return in_region (i, rect,
            "it overlaps region " + std::to_string (other) + ", " +
                rect_text (regions[other].rect));
    slots_ = std::lcm (slots_, code.slots ());
    if (slots_ > kMaxSlots)
      return in_region (i, rect,
          "with its " + std::to_string (code.slots ()) +
              " elements the exposure needs " + std::to_string (slots_) +
              " slots, the least common multiple of all numbers of elements, "
              "and " +
              std::to_string (kMaxSlots) +
              " are possible; take numbers that divide each other");
    order = part->order ();
    in_region_.push_back (*std::move (part));
  }
  white_slots_ = light_of (max_on_slots ());
  for (Schedule &part : in_region_)
    part.fit_into (*this);
  return {};
}

/* A part holds each of its masks for some slots of the exposure. */
void
Schedule::fit_into (const Schedule &whole)
{
  const int held = whole.slots_ / slots_;
  white_slots_ = whole.white_slots_ / held;
  Timing &timing = parts_.timing = whole.timing ();
  if (timing.active > 0)
    timing.active = held * timing.active + (held - 1) * timing.switching;
}

Schedule
Schedule::background () const
{
  Schedule alone (*this);
  alone.parts_.regions.clear ();
  alone.in_region_.clear ();
  alone.slots_ = alone.parts_.code.slots ();
  alone.fit_into (*this);
  return alone;
}

Schedule
Schedule::from_slot (int first) const
{
  Schedule later (*this);
  later.parts_.code = parts_.code.from_slot (first);
  return later;
}

int
Schedule::region_at (int x, int y) const
{
  const auto found =
      std::find_if (parts_.regions.begin (), parts_.regions.end (),
          [x, y] (const Region &region) { return region.rect.holds (x, y); });
  return found == parts_.regions.end () ? -1
                                        : int (found - parts_.regions.begin ());
}

bool
Schedule::on_in_part (int x, int y, int slot) const
{
  const int i = region_at (x, y);
  if (i < 0)
    return parts_.code.on (element_at (x, y), mask_of (parts_.code, slot));
  const Schedule &part = region (i);
  const Rect &rect = parts_.regions[std::size_t (i)].rect;
  return part.on (x - rect.x, y - rect.y, mask_of (part.code (), slot));
}

Result<Schedule>
Schedule::with_leak (double leak) const
{
  Parts parts = parts_;
  parts.leak = leak;
  return make (std::move (parts));
}

Result<Schedule>
Schedule::complement () const
{
  Parts parts = parts_;
  ASSIGN_OR_RETURN (parts.code, parts_.code.complement ());
  for (Region &region : parts.regions) {
    ASSIGN_OR_RETURN (region.code, region.code.complement ());
  }
  ASSIGN_OR_RETURN (Schedule other, make (std::move (parts)));
  other.pilot_inverted_ = !pilot_inverted_;
  return other;
}

Result<void>
Schedule::check_size (int width, int height) const
{
  for (std::size_t i = 0; i < parts_.regions.size (); i++) {
    const Rect &rect = parts_.regions[i].rect;
    const int rows = height - parts_.pilot_rows;
    if (rect.right () <= width && rect.bottom () <= rows)
      continue;
    std::string why =
        "it does not lie within the " + size_text ({width, height}) + " pixels";
    if (parts_.pilot_rows > 0)
      why +=
          " above the pilot's " + std::to_string (parts_.pilot_rows) + " rows";
    return in_region (i, rect, why + "; move it, or make it smaller");
  }
  return {};
}

double
Schedule::light (int element) const
{
  const Code &code = parts_.code;
  return light_of (code.on_slots (element) * (slots_ / code.slots ()));
}

int
Schedule::max_on_slots () const
{
  int most = parts_.code.max_on_slots () * (slots_ / parts_.code.slots ());
  for (const Schedule &part : in_region_)
    most = std::max (most, part.max_on_slots () * (slots_ / part.slots ()));
  return most;
}

} // namespace codedexposure

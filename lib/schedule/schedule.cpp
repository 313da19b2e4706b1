/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/schedule.h"

#include <numeric>

#include "base/text.h"

namespace cexp
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
    if (const auto checked = check_time (name, time); !checked)
      return checked;

  if (!(parts.leak >= 0.0 && parts.leak <= Schedule::kMaxLeak))
    return Error{"leak " + real_text (parts.leak) +
                 ": the light of a shut mirror as a part of an open one's "
                 "must lie in 0..0.5"};
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

/** sequential:2x2, spelt out: its parts are known to be good. */
Schedule::Parts
default_parts ()
{
  Schedule::Parts parts{*Tile::raster (2, 2), *Code::named ("sequential", 4)};
  parts.order = {0, 1, 2, 3};
  return parts;
}

} // namespace

Schedule::Schedule (Parts parts, Extent cell)
    : parts_ (std::move (parts)), cell_ (cell)
{
}

Schedule::Schedule () : Schedule (default_parts (), {2, 2}) {}

Result<Schedule>
Schedule::make (Parts parts)
{
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
  if (const auto checked = check_order (parts.order, elements); !checked)
    return checked.error ();
  if (const auto checked = check_numbers (parts); !checked)
    return checked.error ();

  const auto cell = parts.tile.cell (parts.phase);
  if (!cell)
    return cell.error ();
  return Schedule (std::move (parts), *cell);
}

double
Schedule::white_slots () const
{
  const int open = parts_.code.max_open_slots ();
  return open + parts_.leak * (slots () - open);
}

} // namespace cexp

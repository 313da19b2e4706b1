/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dmd.h"

#include <algorithm>
#include <mutex>

#include "base/try.h"
#include "dmd/drivers.h"

namespace codedexposure
{

namespace
{

std::mutex schemes_lock;

/** Guarded by schemes_lock. */
std::vector<DmdScheme> &
schemes ()
{
  static std::vector<DmdScheme> known = board_schemes ();
  return known;
}

std::vector<DmdScheme>
list_schemes ()
{
  const std::lock_guard guard (schemes_lock);
  return schemes ();
}

} // namespace

Result<std::unique_ptr<Dmd>>
open_dmd (std::string_view device)
{
  std::string known;
  for (const DmdScheme &scheme : list_schemes ()) {
    if (device.starts_with (scheme.prefix))
      return scheme.open (device);
    known += (known.empty () ? "" : ", ") + scheme.usage;
  }
  return Error{"no driver serves the DMD '" + std::string (device) +
                   "'; devices are " + known,
      ErrorCode::not_found};
}

void
add_dmd_scheme (const DmdScheme &scheme)
{
  const std::lock_guard guard (schemes_lock);
  auto &known = schemes ();
  if (std::none_of (known.begin (), known.end (), [&] (const DmdScheme &other) {
        return other.prefix == scheme.prefix;
      }))
    known.insert (known.begin (), scheme);
}

Result<void>
Dmd::show (const StillMask &mask, const SlotPlan &, std::stop_token)
{
  return Error{info ().name + " cannot show " + mask.name +
                   ": it takes no single masks while it runs",
      ErrorCode::unsupported};
}

Result<void>
check_masks (const DmdInfo &info, const Schedule &schedule)
{
  if (schedule.masks () <= info.resident_masks)
    return {};
  return Error{info.name + " holds " + std::to_string (info.resident_masks) +
               " masks, the schedule " + schedule.text () + " has " +
               std::to_string (schedule.masks ()) +
               "; use a tile with fewer elements"};
}

Result<void>
check_limits (
    const DmdInfo &info, const Schedule &schedule, const SlotPlan &plan)
{
  const std::string slots = std::to_string (schedule.slots ()) + " slots";
  RETURN_IF_ERROR (check_masks (info, schedule));
  if (info.array == Array::orthogonal)
    RETURN_IF_ERROR (with_prefix (
        schedule.check_size (info.shown ().width, info.shown ().height),
        info.name + ": "));
  if (info.most_slots > 0 && schedule.slots () > info.most_slots)
    return Error{info.name + " gives the camera a pulse after " +
                 std::to_string (info.most_slots) +
                 " slots or fewer, and the schedule has " + slots +
                 "; use fewer"};
  if (plan.active () < info.minimum_active)
    return Error{slots + " need " + time_text (info.minimum_active) +
                 " each at least on " + info.name + "; " +
                 time_text (plan.frame_period ()) + " a frame leaves " +
                 time_text (plan.active ()) +
                 "; use fewer slots or a lower frame rate"};
  if (schedule.timing ().switching < info.minimum_switching)
    return Error{info.name + " needs " + time_text (info.minimum_switching) +
                 " to switch masks, the schedule leaves " +
                 time_text (schedule.timing ().switching) +
                 "; give it switching=" + time_text (info.minimum_switching)};
  if (!info.patterns)
    return {};
  return with_prefix (check_patterns (plan, *info.patterns), info.name + ": ");
}

} // namespace codedexposure

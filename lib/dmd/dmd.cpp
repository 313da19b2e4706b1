/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dmd.h"

#include "base/try.h"
#include "dmd/drivers.h"

namespace codedexposure
{

Result<std::unique_ptr<Dmd>>
open_dmd (std::string_view device)
{
  std::string known;
  for (const DmdScheme &scheme : dmd_schemes ()) {
    if (device.starts_with (scheme.prefix))
      return scheme.open (device);
    known += std::string (known.empty () ? "" : ", ") + scheme.usage;
  }
  return Error{"no driver serves the DMD '" + std::string (device) +
                   "'; devices are " + known,
      ErrorCode::not_found};
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

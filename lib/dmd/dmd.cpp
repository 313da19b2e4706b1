/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dmd.h"

#include <array>

#include "dmd/lightcrafter.h"
#include "dmd/simulated_dmd.h"
#include "dmd/usb_bus.h"

namespace cexp
{

namespace
{

struct Scheme {
  std::string_view prefix;
  std::string_view usage;
  Result<std::unique_ptr<Dmd>> (*open) (std::string_view device);
};

constexpr std::array kSchemes{
    Scheme{"sim:", "sim:NAME (a simulated DMD)", open_simulated_dmd},
    Scheme{"usb:", "usb:[PORT|SERIAL] (a LightCrafter 4500, 6500 or 9000)",
        open_usb_dmd},
    Scheme{"lightcrafter:",
        "lightcrafter:[HOST[:PORT]] (the first LightCrafter, over TCP)",
        open_lightcrafter}};

} // namespace

Result<std::unique_ptr<Dmd>>
open_dmd (std::string_view device)
{
  std::string known;
  for (const Scheme &scheme : kSchemes) {
    if (device.substr (0, scheme.prefix.size ()) == scheme.prefix)
      return scheme.open (device);
    known += (known.empty () ? "" : ", ") + std::string (scheme.usage);
  }
  return Error{"no driver serves the DMD '" + std::string (device) +
               "'; devices are " + known};
}

Result<void>
Dmd::show (const StillMask &mask, const SlotPlan &, std::stop_token)
{
  return Error{info ().name + " cannot show " + mask.name +
               ": it takes no single masks while it runs"};
}

Result<void>
check_limits (
    const DmdInfo &info, const Schedule &schedule, const SlotPlan &plan)
{
  const std::string slots = std::to_string (schedule.slots ()) + " slots";
  if (schedule.masks () > info.resident_masks)
    return Error{info.name + " holds " + std::to_string (info.resident_masks) +
                 " masks, the schedule " + schedule.text () + " has " +
                 std::to_string (schedule.masks ()) +
                 "; take a tile with fewer elements"};
  if (info.array == Array::orthogonal)
    if (const auto within =
            schedule.check_size (info.shown ().width, info.shown ().height);
        !within)
      return Error{info.name + ": " + within.error ().message};
  if (plan.active () < info.minimum_active)
    return Error{slots + " need " + time_text (info.minimum_active) +
                 " each at least on " + info.name + "; " +
                 time_text (plan.frame_period ()) + " a frame leaves " +
                 time_text (plan.active ()) +
                 "; take fewer slots or a lower frame rate"};
  if (schedule.timing ().switching < info.minimum_switching)
    return Error{info.name + " needs " + time_text (info.minimum_switching) +
                 " to switch masks, the schedule leaves " +
                 time_text (schedule.timing ().switching) +
                 "; give it switching=" + time_text (info.minimum_switching)};
  return {};
}

} // namespace cexp

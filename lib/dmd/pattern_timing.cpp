/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/pattern_timing.h"

#include <algorithm>
#include <string>

#include "base/try.h"

namespace codedexposure
{

namespace
{

constexpr Nanoseconds kMicrosecond = 1000;

std::string
us_text (std::int64_t us)
{
  return time_text (us * kMicrosecond);
}

/** Splits @p pitch microseconds of one slot into light and dark. */
Result<PatternTime>
split_slot (std::int64_t pitch, Nanoseconds switching, const SlotPlan &plan,
    const PatternLimits &limits)
{
  const std::int64_t asked = switching / kMicrosecond;
  const std::int64_t dark =
      asked >= std::max<std::int64_t> (1, limits.minimum_dark) ? asked : 0;
  const std::int64_t exposure = pitch - dark;
  if (exposure < limits.minimum_exposure)
    return Error{"each of " + std::to_string (plan.slots ()) + " slots lasts " +
                 us_text (std::max<std::int64_t> (exposure, 0)) +
                 ", the DMD shows a mask for " +
                 us_text (limits.minimum_exposure) +
                 " at least; use fewer slots or a lower frame rate"};
  if (exposure > limits.maximum_exposure)
    return Error{"each of " + std::to_string (plan.slots ()) + " slots lasts " +
                 us_text (exposure) + ", the DMD shows a mask for " +
                 us_text (limits.maximum_exposure) +
                 " at most; use more slots or a higher frame rate"};
  return PatternTime{std::uint32_t (exposure), std::uint32_t (dark)};
}

Nanoseconds
switching_of (const SlotPlan &plan)
{
  return plan.slots () > 1 ? plan.start (1) - plan.start (0) - plan.active ()
                           : 0;
}

/** Fails if a burst of @p length microseconds is not over, and the controller
 * not ready, before the camera's next edge. */
Result<void>
check_burst (
    std::int64_t length, const SlotPlan &plan, const PatternLimits &limits)
{
  const std::int64_t spare = limits.trigger_delay + limits.trigger_dark;
  const std::int64_t period = plan.frame_period () / kMicrosecond;
  if (length + spare <= period)
    return {};
  return Error{"with the camera as master, the masks take " + us_text (length) +
               " and the trigger " + us_text (limits.trigger_delay) + " + " +
               us_text (limits.trigger_dark) + ", more than the " +
               us_text (period) + " of a frame; give the schedule readout=" +
               us_text (spare + 1) + " more, or let the DMD be master"};
}

} // namespace

Result<std::vector<PatternTime>>
fit_patterns (const SlotPlan &plan, const PatternRule &rule)
{
  const PatternLimits &limits = rule.limits;
  const Nanoseconds switching = switching_of (plan);
  // With the camera as master the burst ends with the light of the last slot.
  const Nanoseconds end = rule.master == Master::dmd
                              ? plan.frame_period ()
                              : plan.exposure () + switching;
  std::vector<PatternTime> times;
  std::int64_t length = 0;
  for (int slot = 0; slot < plan.slots (); slot++) {
    const bool last = slot + 1 == plan.slots ();
    const Nanoseconds next = last ? end : plan.start (slot + 1);
    const std::int64_t pitch =
        next / kMicrosecond - plan.start (slot) / kMicrosecond;
    // All of the time after the last slot's light is dark.
    const Nanoseconds dark =
        last ? next - plan.start (slot) - plan.active () : switching;
    ASSIGN_OR_RETURN (
        const PatternTime time, split_slot (pitch, dark, plan, limits));
    times.push_back (time);
    length += time.exposure + (last ? 0 : time.dark);
  }
  if (rule.master == Master::camera) {
    times.back ().dark = 0; // the controller adds its own before it waits
    RETURN_IF_ERROR (check_burst (length, plan, limits));
  }
  return times;
}

namespace
{

/** "slot 3", "slots 3 to 5" */
std::string
slots_text (const StillMask &mask)
{
  if (mask.slots == 1)
    return "slot " + std::to_string (mask.first);
  return "slots " + std::to_string (mask.first) + " to " +
         std::to_string (mask.first + mask.slots - 1);
}

/** Fails if @p time, for which the mask is @p what, is below @p least or above
 * what the limits allow. */
Result<void>
check_stretch (const StillMask &mask, const SlotPlan &plan, const char *what,
    std::int64_t time, std::int64_t least, const PatternLimits &limits)
{
  const bool too_short = time < least;
  if (!too_short && time <= limits.maximum_exposure)
    return {};
  const std::int64_t limit = too_short ? least : limits.maximum_exposure;
  return Error{mask.name + " in " + slots_text (mask) + " of " +
               std::to_string (plan.slots ()) + " is " + what + " for " +
               us_text (time) + ", the DMD does that for " + us_text (limit) +
               (too_short ? " at least" : " at most") + "; use other slots"};
}

} // namespace

Result<StillTimes>
fit_still (const SlotPlan &plan, const StillMask &mask, const PatternRule &rule)
{
  const PatternLimits &limits = rule.limits;
  const int after = mask.first + mask.slots;
  if (mask.first < 0 || mask.slots < 1 || after > plan.slots ())
    return Error{mask.name + " in " + slots_text (mask) +
                 " does not fit an exposure of slots 0 to " +
                 std::to_string (plan.slots () - 1)};
  const auto us = [] (Nanoseconds time) { return time / kMicrosecond; };
  const std::int64_t least = std::max (limits.minimum_dark, 1u);
  const std::int64_t before = us (plan.start (mask.first));
  const std::int64_t end =
      us (rule.master == Master::dmd ? plan.frame_period () : plan.exposure ());
  const std::int64_t light_ends = us (plan.start (after - 1) + plan.active ());
  const std::int64_t next =
      after == plan.slots () ? end : us (plan.start (after));
  // A shorter pause is the movement of the mirrors.
  const std::int64_t lit_ends = next - light_ends < least ? next : light_ends;
  const std::int64_t lit = lit_ends - before;
  const std::int64_t dark = end - lit_ends;

  RETURN_IF_ERROR (check_stretch (mask, plan, "off before its light", before,
      before > 0 ? limits.minimum_exposure : 0, limits));
  RETURN_IF_ERROR (
      check_stretch (mask, plan, "on", lit, limits.minimum_exposure, limits));
  RETURN_IF_ERROR (check_stretch (
      mask, plan, "off after its light", dark, dark > 0 ? least : 0, limits));
  if (rule.master == Master::camera)
    RETURN_IF_ERROR (check_burst (end, plan, limits));
  return StillTimes{
      std::uint32_t (before), {std::uint32_t (lit), std::uint32_t (dark)}};
}

Result<PatternTime>
fit_equal_patterns (const SlotPlan &plan, const PatternRule &rule)
{
  const PatternLimits &limits = rule.limits;
  const Nanoseconds switching = switching_of (plan);
  const Nanoseconds slot = plan.active () + switching;
  const std::int64_t pitch =
      (rule.master == Master::dmd ? plan.frame_period () / plan.slots ()
                                  : slot) /
      kMicrosecond;
  const Nanoseconds rest = plan.frame_period () - slot * plan.slots ();
  if (rule.master == Master::dmd && rest >= kMicrosecond * plan.slots ())
    return Error{"as master, this DMD repeats its masks without a pause, and " +
                 std::to_string (plan.slots ()) + " slots of " +
                 time_text (slot) + " leave " + time_text (rest) +
                 " of the frame; give the schedule active=0 and readout=0, or "
                 "let the camera be master (master=camera)"};
  ASSIGN_OR_RETURN (
      const PatternTime time, split_slot (pitch, switching, plan, limits));
  if (rule.no_dark && time.dark != 0)
    return Error{"masks from video follow each other without dark time; give "
                 "the schedule switching=0"};
  if (rule.master == Master::camera)
    RETURN_IF_ERROR (check_burst (pitch * plan.slots (), plan, limits));
  return time;
}

Result<void>
check_patterns (const SlotPlan &plan, const PatternRule &rule)
{
  if (rule.equal_times)
    RETURN_IF_ERROR (fit_equal_patterns (plan, rule));
  else
    RETURN_IF_ERROR (fit_patterns (plan, rule));
  return {};
}

} // namespace codedexposure

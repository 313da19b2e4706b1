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
fit_patterns (const SlotPlan &plan, const PatternLimits &limits, Master master)
{
  const Nanoseconds switching = switching_of (plan);
  // With the camera as master the burst ends with the light of the last slot.
  const Nanoseconds end = master == Master::dmd ? plan.frame_period ()
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
  if (master == Master::camera) {
    times.back ().dark = 0; // the controller adds its own before it waits
    RETURN_IF_ERROR (check_burst (length, plan, limits));
  }
  return times;
}

PatternTime
first_patterns (const std::vector<PatternTime> &times, int slots,
    std::uint32_t minimum_dark)
{
  PatternTime first;
  for (std::size_t slot = 0; slot < times.size (); slot++) {
    const PatternTime &time = times[slot];
    if (int (slot) < slots) {
      first.exposure += first.dark + time.exposure;
      first.dark = time.dark;
    } else {
      first.dark += time.exposure + time.dark;
    }
  }
  if (first.dark < minimum_dark)
    first = {first.exposure + first.dark, 0};
  return first;
}

Result<PatternTime>
fit_equal_patterns (
    const SlotPlan &plan, const PatternLimits &limits, Master master)
{
  const Nanoseconds switching = switching_of (plan);
  const Nanoseconds slot = plan.active () + switching;
  const std::int64_t pitch =
      (master == Master::dmd ? plan.frame_period () / plan.slots () : slot) /
      kMicrosecond;
  const Nanoseconds rest = plan.frame_period () - slot * plan.slots ();
  if (master == Master::dmd && rest >= kMicrosecond * plan.slots ())
    return Error{"as master, this DMD repeats its masks without a pause, and " +
                 std::to_string (plan.slots ()) + " slots of " +
                 time_text (slot) + " leave " + time_text (rest) +
                 " of the frame; give the schedule active=0 and readout=0, or "
                 "let the camera be master"};
  ASSIGN_OR_RETURN (
      const PatternTime time, split_slot (pitch, switching, plan, limits));
  if (master == Master::camera)
    RETURN_IF_ERROR (check_burst (pitch * plan.slots (), plan, limits));
  return time;
}

} // namespace codedexposure

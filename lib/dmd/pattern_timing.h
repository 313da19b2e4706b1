/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Slots as the whole microseconds in which controllers count. */
#pragma once

#include <vector>

#include "base/result.h"
#include "schedule/still_mask.h"
#include "schedule/timing.h"

namespace codedexposure
{

/** Which device triggers. */
enum class Master {
  dmd,    ///< the DMD sends the camera one pulse per exposure
  camera, ///< each exposure of the camera starts the masks of that exposure
};

/** One mask: shown for @p exposure, then dark for @p dark, microseconds. */
struct PatternTime {
  std::uint32_t exposure = 0;
  std::uint32_t dark = 0;
  bool operator== (const PatternTime &) const = default;
};

/** Limits of a controller, in microseconds. */
struct PatternLimits {
  std::uint32_t minimum_exposure = 0;
  std::uint32_t maximum_exposure = 0;
  /** Min dark time other than 0. */
  std::uint32_t minimum_dark = 0;
  /** From the camera's edge to light, with the camera as master. */
  std::uint32_t trigger_delay = 0;
  /** Dark time that the controller inserts before it waits for an edge. */
  std::uint32_t trigger_dark = 0;
};

/** How a controller times the masks of an exposure. */
struct PatternRule {
  PatternLimits limits = {};
  Master master = Master::dmd;
  bool equal_times = false; ///< fit_equal_patterns (), else fit_patterns ()
  bool no_dark = false;     ///< masks follow each other without dark time
};
/** Whether a controller can show a mask in each slot of @p plan. */
Result<void> check_patterns (const SlotPlan &plan, const PatternRule &rule);

/**
 * The times of the N masks of one exposure.
 *
 * Slot starts are rounded down to microseconds, so that errors do not add up.
 * The switching time of the plan becomes dark time if the controller can do it;
 * a shorter one is the movement of the mirrors, within the exposure. With the
 * DMD as master, the last mask lasts to the end of the frame period, rounded
 * down: the camera follows, by 1 us per frame at most.
 *
 * Fails if a mask is too short or too long, or, with the camera as master, if
 * its slots leave too little of the frame period for the trigger.
 */
Result<std::vector<PatternTime>> fit_patterns (
    const SlotPlan &plan, const PatternRule &rule);

/** How a still mask stands in an exposure. */
struct StillTimes {
  /** All mirrors are off before it for that long; 0: it comes first. */
  std::uint32_t before = 0;
  PatternTime lit; ///< the mask, then dark until the next exposure
  bool operator== (const StillTimes &) const = default;
};

/**
 * The times of one mask that is shown in slots [first, first + slots) of an
 * exposure of @p plan. Slots may be shorter than the shortest time of a mask,
 * as long as the mask and the dark around it are not. A dark time after the
 * light of the last slot that is too short for the controller is left out.
 *
 * Fails if the plan does not have these slots, or like fit_patterns ().
 */
Result<StillTimes> fit_still (
    const SlotPlan &plan, const StillMask &mask, const PatternRule &rule);

/**
 * fit_patterns () for controllers with one exposure and one dark time for all
 * masks; slots are rounded down. With the DMD as master, the slots must fill
 * the frame period, because such a controller has no pause.
 */
Result<PatternTime> fit_equal_patterns (
    const SlotPlan &plan, const PatternRule &rule);

} // namespace codedexposure

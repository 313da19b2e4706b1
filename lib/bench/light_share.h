/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The light that slots collect in parts of a frame period. */
#pragma once

#include <vector>

#include "schedule/timing.h"

namespace codedexposure
{

/** Part of one slot's light. */
struct LightShare {
  int slot = 0;
  /** Fraction of the slot's active time, in (0, 1]. */
  double slots = 0.0;

  bool operator== (const LightShare &) const = default;
};

/**
 * Divides a frame period into @p stretches of equal length, each of constant
 * light, and returns what every slot collects of each: nothing while the
 * mirrors switch or the camera reads out.
 *
 * Shares are multiples of 2^-20, and those of one slot add up to exactly 1, so
 * that rounding to nanoseconds has no effect in constant light.
 *
 * @return the shares of each stretch, by slot; none if no slot is active.
 */
std::vector<std::vector<LightShare>> share_light (
    const SlotPlan &plan, int stretches);

} // namespace codedexposure

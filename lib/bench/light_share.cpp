/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/light_share.h"

#include <cmath>

namespace codedexposure
{

namespace
{

/* The part of @slot's active time before edge @edge of @stretches. The plan's
 * times are rounded down to nanoseconds, so that an edge within two of them
 * counts as the start or the end of the slot. */
double
open_before (const SlotPlan &plan, int slot, int edge, int stretches)
{
  const std::int64_t slack = 2 * stretches;
  const std::int64_t active = plan.active () * stretches;
  const std::int64_t since_open =
      edge * plan.frame_period () - stretches * plan.start (slot);
  if (since_open < slack)
    return 0.0;
  if (since_open > active - slack)
    return 1.0;
  const double part = double (since_open) / double (active);
  return std::ldexp (std::round (std::ldexp (part, 20)), -20);
}

} // namespace

std::vector<std::vector<LightShare>>
share_light (const SlotPlan &plan, int stretches)
{
  std::vector<std::vector<LightShare>> shares (
      static_cast<std::size_t> (stretches));
  for (int slot = 0; slot < plan.slots (); slot++) {
    double before = 0.0;
    for (int i = 0; i < stretches && before < 1.0; i++) {
      const double after = open_before (plan, slot, i + 1, stretches);
      if (after > before)
        shares[std::size_t (i)].push_back ({slot, after - before});
      before = after;
    }
  }
  return shares;
}

} // namespace codedexposure

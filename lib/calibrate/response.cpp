/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/response.h"

#include <algorithm>
#include <cmath>

#include "estimate/mirror_share.h"

namespace codedexposure
{

GratingResponse::GratingResponse (int period, double side, double sigma)
    : period_ (period)
{
  const int steps = period * kSteps;
  table_.resize (std::size_t (2 * steps + 2));
  for (int i = 0; i < steps; i++) {
    EdgeLight sum = {};
    /* Mirrors 0..period / 2 - 1 are on, and edges between mirrors. */
    const int reach = 1 + int ((side + 6.0 * sigma) / period);
    for (int i_period = -reach; i_period <= reach; i_period++) {
      const double from = double (i) / kSteps + 0.5 - i_period * period;
      const EdgeLight up = edge_light (from, side, sigma);
      const EdgeLight down = edge_light (from - period / 2, side, sigma);
      sum.light += up.light - down.light;
      sum.slope += up.slope - down.slope;
      sum.blur += up.blur - down.blur;
    }
    table_[std::size_t (i)] = {
        float (sum.light), float (sum.slope), float (sum.blur), 0.0f};
  }
  for (int i = steps; i < int (table_.size ()); i++)
    table_[std::size_t (i)] = table_[std::size_t (i - steps)];
}

GratingResponse::Entry
GratingResponse::entry (double place) const
{
  const double periods = place / period_;
  const double step = (periods - std::floor (periods)) * period_ * kSteps;
  const std::size_t low =
      std::min (std::size_t (step), std::size_t (period_ * kSteps - 1));
  return {low, float (step - double (low))};
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "estimate/observation.h"

#include <algorithm>

namespace codedexposure
{

Observation::Observation (const std::optional<Schedule> &schedule,
    const SensorNoise &noise, double white_electrons, double steps)
    : noise_ (noise), white_electrons_ (white_electrons), steps_ (steps),
      exact_ (!schedule ||
              (schedule->code ().one_hot () && schedule->leak () == 0.0))
{
  if (!schedule) {
    shares_ = {{{0, 1.0}}};
    gain_ = {1.0};
    return;
  }
  for (int e = 0; e < schedule->slots (); e++) {
    const double total = schedule->light (e);
    auto &shares = shares_.emplace_back ();
    for (int s = 0; s < schedule->slots (); s++)
      if (const double light = schedule->light (e, s); light > 0.0)
        shares.push_back ({s, light / total});
    gain_.push_back (schedule->white_slots () / total);
  }
}

bool
Observation::gains () const
{
  return std::any_of (
      gain_.begin (), gain_.end (), [] (double gain) { return gain != 1.0; });
}

double
Observation::variance (int element, double light) const
{
  const double gain_squared = gain (element) * gain (element);
  if (noise_free ())
    return gain_squared / (12.0 * steps_ * steps_);
  const double electrons = light / gain (element) * white_electrons_;
  return gain_squared * noise_.variance (electrons, white_electrons_ / steps_) /
         (white_electrons_ * white_electrons_);
}

} // namespace codedexposure

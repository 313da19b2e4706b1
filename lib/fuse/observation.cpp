/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/observation.h"

#include <algorithm>
#include <numeric>

namespace cexp
{

Observation::Observation (
    const Schedule &schedule, const SensorNoise &noise, double steps)
    : n_ (schedule.slots ()), noise_ (noise),
      white_electrons_ (noise.full_well * schedule.white_slots () / n_),
      steps_ (steps),
      exact_ (schedule.code ().one_hot () && schedule.leak () == 0.0)
{
  for (int e = 0; e < n_; e++) {
    std::vector<double> light;
    for (int s = 0; s < n_; s++)
      light.push_back (schedule.code ().open (e, s) ? 1.0 : schedule.leak ());
    const double total = std::accumulate (light.begin (), light.end (), 0.0);
    auto &shares = shares_.emplace_back ();
    for (int s = 0; s < n_; s++)
      if (light[std::size_t (s)] > 0.0)
        shares.push_back ({s, light[std::size_t (s)] / total});
    gain_.push_back (schedule.white_slots () / total);
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

Phases::Phases (const Schedule &schedule)
    : schedule_ (schedule), period_ (schedule.tile ().period_x ())
{
  for (int y = 0; y < schedule.tile ().period_y (); y++) {
    Row found{-1, 0};
    for (int row = 0; row < rows () && found.row < 0; row++) {
      for (int shift = 0; shift < period_ && found.row < 0; shift++)
        if (is_shift (y, row_starts_[std::size_t (row)], shift))
          found = {row, shift};
    }
    if (found.row < 0) {
      found.row = rows ();
      row_starts_.push_back (y);
    }
    rows_.push_back (found);
  }
}

/* Whether everything seen from row @y equals what is seen from row @from,
 * @shift pixels to the right. */
bool
Phases::is_shift (int y, int from, int shift) const
{
  for (int dy = 0; dy < schedule_.tile ().period_y (); dy++)
    for (int x = 0; x < period_; x++)
      if (schedule_.element_at (x, y + dy) !=
          schedule_.element_at (x + shift, from + dy))
        return false;
  return true;
}

} // namespace cexp

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/decoder.h"

#include <cmath>
#include <cstdlib>

#include "base/try.h"

namespace codedexposure
{

namespace
{

constexpr double kRounding = 1e-9;

/** Removes the rounding error of the inversion from a factor that is a multiple
 * of a quarter, as those of a staircase are: such sums are exact. */
double
snapped (double factor)
{
  const double quarters = std::round (4.0 * factor) / 4.0;
  return std::abs (factor - quarters) < kRounding ? quarters : factor;
}

} // namespace

Result<Decoder>
Decoder::make (const Schedule &schedule, double gain, bool interpolate)
{
  ASSIGN_OR_RETURN (
      const auto inverse, schedule.code ().inverse (schedule.leak ()));

  const SampleGrid grid (schedule);
  Decoder decoder;
  decoder.cell_ = grid.cell ();
  decoder.gain_ = gain > 0.0 ? gain : schedule.white_slots ();
  decoder.interpolates_ = interpolate && grid.repeat () == Extent{1, 1} &&
                          !schedule.code ().one_hot ();

  const int n = schedule.elements ();
  const double unit = decoder.interpolates_ ? 4.0 * n : 1.0;
  decoder.starts_.push_back (0);
  for (int s = 0; s < n; s++) {
    for (int e = 0; e < n; e++) {
      /* Every slot has a term, even if its factor rounds to 0. */
      const double light = inverse[std::size_t (s * n + e)];
      if (std::abs (light) > kRounding)
        decoder.terms_.push_back ({e, snapped (decoder.gain_ * light / unit)});
    }
    decoder.starts_.push_back (decoder.terms_.size ());
  }
  return decoder;
}

Lerp
Decoder::lerp (int position, int length) const
{
  if (!interpolates_)
    return {};
  const int twice_to_centre = length - 1 - 2 * position;
  const int far = std::abs (twice_to_centre);
  return {2 * length - far, far, twice_to_centre < 0 ? -1 : 1};
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/runs.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/try.h"
#include "doctor/statistics.h"

namespace codedexposure
{

Result<void>
Runs::see (const StillMask &mask, int exposure, int frames)
{
  RETURN_IF_ERROR (look (examination_, mask, grid_, 0));
  const auto came = watch_each (examination_.rig, frames, [&] (auto &frame) {
    if (frame.damaged)
      return;
    const Level level =
        level_of (frame.picture.view (), examination_.rig.parts ().largest ());
    bits_seen |= level.bits_seen;
    const int step = bits_seen ? bits_seen & -bits_seen : 1; // DN
    borders.push_back (border_light (frame.picture.view ()));
    const double pixels =
        double (frame.picture.width ()) * frame.picture.height ();
    samples.push_back ({1e-9 * double (frame.time), mask.first * slot (),
        (mask.first + mask.slots) * slot (), level.mean,
        rounding_doubt (level.noise, step), exposure,
        level.noise / std::sqrt (std::max (1.0, pixels))});
  });
  return came ? Result<void> () : came.error ();
}

Result<void>
Runs::see_one (int number, int first, int slots, int exposure, int frames)
{
  using std::numbers::phi, std::numbers::sqrt2;
  const auto part = [] (double turns) { return turns - std::floor (turns); };
  const int count =
      std::clamp (int (grid_ * (1.0 + part (number * sqrt2)) / 16.0), 1,
          std::max (1, slots - 1));
  const int room = slots - count;
  const int place = int (part ((number + 1) * phi) * (room + 1));
  return see (lit (first + std::min (place, room), count), exposure, frames);
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames in which all mirrors are on for a part of the cycle. */
#pragma once

#include <vector>

#include "doctor/checks.h"
#include "doctor/light_model.h"
#include "doctor/response.h"

namespace codedexposure
{

/** Shows runs of slots, of which a cycle has a number, and keeps a sample of
 * each frame. */
class Runs
{
public:
  Runs (Examination &examination, int grid)
      : examination_ (examination), grid_ (grid)
  {
  }

  double slot () const { return examination_.rig.parts ().period () / grid_; }
  int grid () const { return grid_; }
  /** Frames of @p mask; @p exposure: of the samples. */
  Result<void> see (const StillMask &mask, int exposure, int frames);
  /**
   * A run somewhere in slots [@p first, @p first + @p slots). Places and
   * lengths are spread evenly over @p number = 0, 1, ..., and their order is
   * not that of time, so that no frequency hides. They have 1/16 to 1/8 of the
   * cycle.
   */
  Result<void> see_one (
      int number, int first, int slots, int exposure, int frames);

  std::vector<LightSample> samples = {};
  std::vector<BorderLight> borders = {}; ///< of the same frames
  int bits_seen = 0;                     ///< in any pixel value

private:
  Examination &examination_;
  int grid_;
};

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Finds the phase of the tile from one coded frame, without a calibration. */
#pragma once

#include <cstdint>

#include "base/image.h"
#include "base/result.h"
#include "schedule/schedule.h"

namespace codedexposure
{

struct TilePhase {
  /** For Schedule::Parts::phase. */
  Offset phase;
  /** Probability of this phase, if all phases are equally likely before:
   * 1 / (number of phases) for a frame without information. */
  double confidence = 0.0;
  /** Differences of the elements' light relative to those of the code: 1 for a
   * sharp image of the mirrors, 0 if there are none. */
  double contrast = 0.0;
};

/**
 * Elements of a staircase are on for different times, so that their mean light
 * identifies them in every scene. Of all phases of the schedule's tile, the one
 * whose light fits the means of the frame's pixels at each place of the tile's
 * period best is taken.
 *
 * The confidence follows from the differences between parts of the frame, which
 * show how much the scene itself contributes.
 *
 * @p schedule  its phase is ignored. Error for a code whose elements all
 *              get the same light, such as sequential, and for a frame of less
 *              than 8 x 8 periods.
 */
template <typename Pixel> // std::uint8_t or std::uint16_t
Result<TilePhase> find_tile_phase (
    ImageView<const Pixel> frame, const Schedule &schedule);

} // namespace codedexposure

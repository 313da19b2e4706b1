/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where the tile lies, from one coded frame and no calibration. */
#pragma once

#include <cstdint>

#include "base/image.h"
#include "base/result.h"
#include "schedule/schedule.h"

namespace cexp
{

struct TilePhase {
  /** For Schedule::Parts::phase. */
  Offset phase;
  /** Probability that it is this one, all phases being as likely before the
   * frame was seen: 1 / (number of phases) for a frame that says nothing. */
  double confidence = 0.0;
  /** Differences of the elements' light as a part of what the code makes them:
   * 1 for a camera without blur on its mirrors, 0 where there are none. */
  double contrast = 0.0;
};

/**
 * Elements of a staircase are open for different times, so their mean light
 * tells them apart whatever the scene shows. Of all phases of the schedule's
 * tile, the one by which the light of the frame's places in the tile's period
 * follows that of the code best.
 *
 * How far the scene itself makes places differ is judged by how much parts of
 * the frame differ; that makes the confidence.
 *
 * @p schedule  its phase does not matter. Error for a code whose elements all
 *              get the same light, such as sequential, and for a frame of less
 *              than 8 x 8 periods.
 */
Result<TilePhase> find_tile_phase (
    ImageView<const std::uint8_t> frame, const Schedule &schedule);
Result<TilePhase> find_tile_phase (
    ImageView<const std::uint16_t> frame, const Schedule &schedule);

} // namespace cexp

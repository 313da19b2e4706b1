/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The phase of the masks in one frame, also as read from the pilot. */
#pragma once

#include <array>
#include <optional>

#include "schedule/pilot.h"

namespace codedexposure
{

struct PhaseReading {
  enum class Kind {
    unclear,  ///< too dark, or explained by neither
    in_phase, ///< as in the schedule
    slipped,  ///< the masks are shown in wrong slots
    parked,   ///< the mirrors show no mask
  };

  Kind kind = Kind::unclear;
  /** Slots by which the masks come late (> 0) or early (< 0), when slipped. */
  int slots = 0;
  /** No other slip by as few slots explains the frame as well. In phase: the
   * pilot shows every mask of the frame, so that no slip can hide. */
  bool certain = true;
  /** In phase: the frame of the pilot that is shown, 0 or 1; they alternate. */
  std::optional<int> half = {};

  bool operator== (const PhaseReading &) const = default;
};

/**
 * The phase that the pilot of a frame shows.
 *
 * Lit columns are told from dark ones by comparison, so that neither the light
 * of the scene nor off-state leakage matters. A frame whose lit columns have
 * masks of one of the pilot's two frames is in phase; other columns are only
 * lit by masks in wrong slots. If a mask of that frame is missing, the scene is
 * dark there or, after a late slip within the exposure, it was not shown: the
 * frame is in phase, but not for certain.
 *
 * @p slots  of the schedule.
 * @p means  of the pilot's columns, in digital numbers.
 */
PhaseReading read_pilot (
    int slots, const std::array<double, kPilotColumns> &means);

} // namespace codedexposure

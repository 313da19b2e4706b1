/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What one frame shows of the phase of the masks against the exposure. */
#pragma once

namespace codedexposure
{

struct PhaseReading {
  enum class Kind {
    unclear,  ///< too dark, or explained by neither
    in_phase, ///< as the schedule has it
    slipped,  ///< the masks stand in slots that are not theirs
    parked,   ///< the mirrors show no mask at all
  };

  Kind kind = Kind::unclear;
  /** Slots by which the masks come late (> 0) or early (< 0), when slipped. */
  int slots = 0;
  /** No other slip by as few slots explains the frame as well. */
  bool certain = true;

  bool operator== (const PhaseReading &) const = default;
};

} // namespace codedexposure

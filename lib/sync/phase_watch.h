/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The phase of the masks from a coded frame. */
#pragma once

#include <cstdint>
#include <optional>

#include "base/image.h"
#include "schedule/schedule.h"
#include "sync/level_meter.h"
#include "sync/phase_reading.h"
#include "sync/slip_signature.h"

namespace codedexposure
{

/** In which frames a slip of the DMD by whole slots is visible. */
enum class SlipObservable {
  never,        ///< in no frame
  in_the_frame, ///< only in the frame during whose exposure it happens
  always,       ///< in every frame while it lasts
};

/** With a pilot, always. Without one, in the frame if the code has a level
 * signature; that of a one-hot code cannot be told from a flash of light in one
 * slot. */
SlipObservable slip_observable (const Schedule &schedule);

/** What a frame shows, and whether it is certain. */
struct PhaseSight {
  PhaseReading reading;
  /** The next frame shows for certain whether this slip is real. */
  bool next_frame_tells = false;
};

/** Combines the pilot and the signature of the levels; frames of one size. */
class PhaseWatch
{
public:
  /** @p black  as of LevelMeter. */
  PhaseWatch (
      const Schedule &schedule, int width, int height, double black = 0.0);

  /** Whether the frames are large enough to hold every element, and the pilot
   * where there is one. */
  bool complete () const { return meter_.complete (); }

  template <typename Pixel>
  PhaseSight look (ImageView<const Pixel> frame)
  {
    return judge (meter_.measure (frame));
  }

private:
  PhaseSight judge (const Levels &levels);

  LevelMeter meter_;
  std::optional<SlipSignature> signature_;
  int pilot_slots_ = 0; // 0: no pilot
};

} // namespace codedexposure

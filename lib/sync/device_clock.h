/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A camera's own clock, told by the pipeline's. */
#pragma once

#include <cstdint>
#include <optional>

#include "schedule/timing.h"
#include "sync/lower_edge.h"

namespace codedexposure
{

/**
 * Turns the times that a camera stamps by a clock of its own into those of the
 * pipeline's clock, from when its frames arrive.
 *
 * A frame arrives late by what is the same for all, exposure and transfer, and
 * by what differs, queues and schedulers. The latter only ever delays. So the
 * times that frames would have arrived at with none of it lie on a line below
 * all arrivals, which LowerEdge estimates. No delay, however long, can pull it
 * up, and it comes closer to the truth with the number of frames, not its root.
 *
 * The line is one through the last few thousand frames, so that it follows a
 * drift that changes within minutes. The common delay cannot be seen in it.
 */
class DeviceClock
{
public:
  /** Drifts beyond this are none of a clock: 500 ppm. */
  static constexpr double kMostDrift = 500e-6;

  /**
   * The pipeline time at which a frame stamped @p device arrives when nothing
   * holds it up. It never runs back from frame to frame, and where the line
   * falls it does so by no more than half the distance of two frames at once.
   *
   * Begins anew by itself when the camera's clock does: where @p device lies a
   * second back, or the frame arrives before it could. A frame that is stamped
   * earlier than the one before is told its time, but teaches nothing.
   *
   * @p arrival  by the pipeline's clock.
   */
  Nanoseconds take (Nanoseconds device, Nanoseconds arrival);
  /** Forgets everything: the next frame is the first. */
  void reset ();
  /** The camera begins anew: the next frame is the first, of a clock whose
   * drift is about the same, unless frames show another. */
  void rejoin ();

  /** By how much the camera's clock is faster, as a part of it; 0 before there
   * are two frames. */
  double drift () const { return -line_.slope / (1 + line_.slope); }
  /** By how much the last frame arrived after its time, >= 0. */
  Nanoseconds lateness () const { return lateness_; }
  /** What the error of the last frame's time stays below in 95 of 100 frames;
   * none while there are too few to say. */
  std::optional<Nanoseconds> uncertainty () const { return uncertainty_; }
  /** How often it began anew since it was made, the first time not counted. */
  std::uint64_t restarts () const { return restarts_; }

private:
  void begin (Nanoseconds device, Nanoseconds arrival);
  void remember_drift ();
  bool is_anew (Nanoseconds device, Nanoseconds arrival) const;
  void learn (LowerEdge::Point point);
  Nanoseconds told (Nanoseconds device) const;

  struct Mark {
    Nanoseconds device;
    Nanoseconds told;
  };

  std::optional<Mark> last_; // none: nothing was learned
  Nanoseconds origin_device_ = 0;
  Nanoseconds origin_arrival_ = 0;
  /* Delays, arrival - device, by device time, both since the first frame; they
   * grow as the camera's clock lags. One point at least every kSpacing, the
   * lowest there. */
  LowerEdge edge_{kMostDrift};
  LowerEdge::Line line_;
  std::optional<double> deviation_; // of the line at the last frame
  std::optional<Nanoseconds> uncertainty_;
  Nanoseconds lateness_ = 0;
  std::uint64_t restarts_ = 0;
};

} // namespace codedexposure

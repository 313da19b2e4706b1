/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A camera's own clock, converted to the pipeline's. */
#pragma once

#include <cstdint>
#include <optional>

#include "schedule/timing.h"
#include "sync/lower_edge.h"

namespace codedexposure
{

/**
 * Converts the time stamps of a camera's clock to the pipeline's clock, from
 * the arrival times of its frames.
 *
 * A frame arrives with a common delay, from exposure and transfer, and with one
 * that differs from frame to frame, from queues and schedulers. The latter is
 * never negative, so the arrival times without it lie on a line below all
 * arrivals, which LowerEdge estimates. No delay, however long, moves it up, and
 * its error falls with the number of frames, not with the root of it.
 *
 * The line is fitted to the last few thousand frames and so follows a drift
 * that changes within minutes. It does not show the common delay.
 */
class DeviceClock
{
public:
  /** Max drift of a clock: 500 ppm. */
  static constexpr double kMaxDrift = 500e-6;

  /**
   * The pipeline time at which a frame stamped @p device arrives without the
   * varying delay. It never decreases from frame to frame; if the line falls,
   * the time lags by at most half the distance of two frames.
   *
   * Restarts when the camera's clock does: if @p device steps back by a second,
   * or the frame arrives before it could. A frame with an earlier stamp than
   * the one before gets its time, but does not change the line.
   *
   * @p arrival  by the pipeline's clock.
   */
  Nanoseconds take (Nanoseconds device, Nanoseconds arrival);
  /** The same for a time at which no frame came: changes nothing. None before
   * the first frame, and if @p device steps back by a second. */
  std::optional<Nanoseconds> time_of (Nanoseconds device) const;
  /** Forgets everything: the next frame is the first. */
  void reset ();
  /** The camera restarts: the next frame is the first, of a clock with about
   * the same drift, unless frames show another. */
  void rejoin ();

  /** By which part the camera's clock is faster; 0 before the second frame. */
  double drift () const { return -line_.slope / (1 + line_.slope); }
  /** Varying delay of the last frame, >= 0. */
  Nanoseconds lateness () const { return lateness_; }
  /** 95 % bound on the error of the last frame's time; none after too few
   * frames. */
  std::optional<Nanoseconds> uncertainty () const { return uncertainty_; }
  /** Number of restarts, without the first start. */
  std::uint64_t restarts () const { return restarts_; }

private:
  void begin (Nanoseconds device, Nanoseconds arrival);
  void remember_drift ();
  bool went_back (Nanoseconds device) const;
  bool is_restart (Nanoseconds device, Nanoseconds arrival) const;
  void learn (LowerEdge::Point point);
  Nanoseconds pipeline_time (Nanoseconds device) const;

  struct Mark {
    Nanoseconds device;
    Nanoseconds pipeline_time;
  };

  std::optional<Mark> last_; // none: no frame yet
  Nanoseconds origin_device_ = 0;
  Nanoseconds origin_arrival_ = 0;
  /* Delays, arrival - device, by device time, both since the first frame; they
   * grow as the camera's clock lags. One point at least every kSpacing, the
   * lowest there. */
  LowerEdge edge_{kMaxDrift};
  LowerEdge::Line line_;
  std::optional<double> deviation_; // of the line at the last frame
  std::optional<Nanoseconds> uncertainty_;
  Nanoseconds lateness_ = 0;
  std::uint64_t restarts_ = 0;
};

} // namespace codedexposure

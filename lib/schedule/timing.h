/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How the slots lie in a frame period, in integer nanoseconds. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace codedexposure
{

using Nanoseconds = std::int64_t;

/** Times of a schedule are non-negative and below this: an hour. */
constexpr Nanoseconds kTimeLimit = 3'600'000'000'000;

/** Frames per second as the exact fraction that caps carry; both > 0. */
struct FrameRate {
  int num = 25;
  int den = 1;

  /** floor ((index + part / parts) frame periods): the start of slot @p part
   * of frame @p index. Exact as long as the time itself fits; index >= 0,
   * 0 <= part <= parts. */
  Nanoseconds time_of (std::int64_t index, int part = 0, int parts = 1) const;
  /** One frame period, rounded down. */
  Nanoseconds period () const { return time_of (1); }
  /** The fraction with the smallest numbers whose period is @p period, to less
   * than 1 ns; none if they are too large. */
  static std::optional<FrameRate> of_period (Nanoseconds period);
  bool operator== (const FrameRate &) const = default;
};

/**
 * What a schedule fixes of its slots. The frame period is the camera's
 * and comes with the caps; fit () combines both.
 */
struct Timing {
  /** Time for which a mask is shown, t_i; 0: all that the frame period leaves,
   * in equal slots. */
  Nanoseconds active = 0;
  /** Time between two masks in which the mirrors move, t_r. */
  Nanoseconds switching = 0;
  /** Time at the end of the frame in which the camera collects no light (dead
   * time). */
  Nanoseconds readout = 0;

  bool operator== (const Timing &) const = default;
};

/** The slots of one frame: the mask of slot s is shown in [start (s), start (s)
 * + active), counted from the start of the exposure. */
class SlotPlan
{
public:
  /**
   * Paper, Eq. 8: frame period = N t_i + dt, where dt holds the N t_r of
   * switching and the readout. Error with the numbers when the slots do not
   * fit the frame period or nothing of it is left for light.
   */
  static Result<SlotPlan> fit (const Timing &timing, int slots, FrameRate rate);

  int slots () const { return slots_; }
  Nanoseconds frame_period () const { return period_; }
  Nanoseconds active () const { return active_; }
  Nanoseconds start (int slot) const;
  /** End of the last slot's light. */
  Nanoseconds exposure () const { return start (slots_ - 1) + active_; }

private:
  int slots_ = 1;
  Nanoseconds period_ = 0;
  Nanoseconds active_ = 0;
  /** Slots start at floor (s * span_ / slots_). */
  Nanoseconds span_ = 0;
};

/** "9.8ms", "200us", "105000ns", "0.04s" or "0": a non-negative time below an
 * hour. The unit may only be left out for 0. */
Result<Nanoseconds> parse_time (std::string_view text);
/** Such a text, in the largest unit that keeps it at 1 or more, that parses
 * back to @p time; @p time >= 0. */
std::string time_text (Nanoseconds time);

} // namespace codedexposure

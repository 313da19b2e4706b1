/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Whether frames come at the announced rate. */
#pragma once

#include <optional>
#include <vector>

#include "schedule/timing.h"

namespace codedexposure
{

/**
 * Measures the frame rate from the times of frames, in spite of jitter and
 * losses, over 64 steps at a time, and roughly over the first 24. A camera with
 * an external trigger may run at another rate than the requested one.
 */
class RateWatch
{
public:
  /** Smaller relative differences are ignored: it is more than the error of any
   * clock, and than the effect of a jitter of a quarter period. */
  static constexpr double kTolerance = 0.01;
  /** The same over the first 24 steps, where a frame that is held up weighs
   * more. */
  static constexpr double kRoughTolerance = 0.25;

  explicit RateWatch (FrameRate announced) : announced_ (announced) {}

  /** The measured rate, if it differs from the announced one and from the last
   * one returned. @p time of the frame, ascending; any epoch. */
  std::optional<double> take (Nanoseconds time);
  /** The next frame may follow at any time. */
  void resync () { last_.reset (); }

private:
  FrameRate announced_;
  std::optional<Nanoseconds> last_;
  std::vector<Nanoseconds> steps_;
  double reported_ = 0;  // 0: the announced one
  bool is_first_ = true; // of the steps
};

} // namespace codedexposure

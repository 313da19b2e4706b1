/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Whether frames come at the rate that was said. */
#pragma once

#include <optional>
#include <vector>

#include "schedule/timing.h"

namespace codedexposure
{

/**
 * Measures the frame rate from the times of frames, whatever their jitter and
 * losses, over 64 steps at a time. A camera that somebody else triggers may
 * well run at another rate than the one it was asked for.
 */
class RateWatch
{
public:
  /** Rates that differ by less are the same: more than any clock is wrong by,
   * and than jitter of a quarter period makes. */
  static constexpr double kTolerance = 0.01;

  explicit RateWatch (FrameRate said) : said_ (said) {}

  /** The rate that was measured, where it is another than was said, and than
   * was returned last. @p time of the frame, rising; any epoch. */
  std::optional<double> take (Nanoseconds time);
  /** The next frame follows at whatever time it has. */
  void resync () { last_.reset (); }

private:
  FrameRate said_;
  std::optional<Nanoseconds> last_;
  std::vector<Nanoseconds> steps_;
  double told_ = 0; // 0: what was said
};

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The line that triggers several cameras. */
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>

#include "base/image.h"
#include "bench/sick_bench.h"
#include "emulation/frame_source.h"

namespace codedexposure::app
{

/** Pulses from the first time on that a camera asks. Thread-safe. */
class SharedTrigger
{
public:
  explicit SharedTrigger (Nanoseconds period) : period_ (period) {}

  /** Waits for the end of the first exposure after @p last, unless that was
   * long ago: then of the present one. Waits for two periods at most, so that
   * the camera can answer meanwhile; none if there was none. */
  std::optional<Shot> next (const std::optional<std::uint64_t> &last);

private:
  using Clock = std::chrono::steady_clock;

  const Nanoseconds period_;
  std::mutex lock_;
  std::optional<Clock::time_point> began_;
};

/** One of these cameras: frame n of its source is that of exposure n. */
class TriggeredCamera
{
public:
  TriggeredCamera (SharedTrigger &trigger, FrameSource &frames)
      : trigger_ (trigger), frames_ (frames)
  {
  }

  /** GigeCameraOptions::shoot. */
  std::optional<Shot> shoot (ImageView<std::uint16_t> picture);

private:
  SharedTrigger &trigger_;
  FrameSource &frames_;
  std::optional<std::uint64_t> last_;
  std::uint64_t taken_ = 0; ///< frames of the source
};

} // namespace codedexposure::app

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The line that triggers several cameras. */
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <thread>

#include "bench/sick_bench.h"

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
  std::optional<Shot> next (const std::optional<std::uint64_t> &last)
  {
    /* A camera that is later than this loses exposures. */
    constexpr std::uint64_t kBehind = 4;
    const auto began = [this] {
      const std::lock_guard guard (lock_);
      if (!began_)
        began_ = Clock::now ();
      return *began_;
    }();
    const auto now =
        Nanoseconds (std::chrono::nanoseconds (Clock::now () - began).count ());
    const auto present = std::uint64_t (now / period_);
    std::uint64_t number = last ? *last + 1 : present;
    if (present > number + kBehind)
      number = present;
    if (number > present + 1) {
      std::this_thread::sleep_for (std::chrono::nanoseconds (period_));
      return std::nullopt;
    }
    const Nanoseconds begin = Nanoseconds (number) * period_;
    std::this_thread::sleep_until (
        began + std::chrono::nanoseconds (begin + period_));
    return Shot{.number = number,
        .trigger = begin,
        .begin = begin,
        .end = begin + period_};
  }

private:
  using Clock = std::chrono::steady_clock;
  const Nanoseconds period_;
  std::mutex lock_;
  std::optional<Clock::time_point> began_;
};

} // namespace codedexposure::app

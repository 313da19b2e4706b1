/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Whether the process was stopped. */
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace codedexposure
{

/**
 * Notices that the process did not run for a while: it was stopped (Ctrl-Z,
 * SIGSTOP, a debugger) or got no processor. Deadlines that passed meanwhile say
 * nothing of other devices.
 *
 * A thread wakes ten times a second and looks at the clock.
 */
class PauseWatch
{
public:
  using Clock = std::chrono::steady_clock;

  PauseWatch ();

  /** The pause that ended within the last @p within, or has just ended; 0:
   * there was none of at least kMinPause. Any thread. */
  Clock::duration recent (Clock::duration within) const;

  static constexpr std::chrono::milliseconds kMinPause{1000};

private:
  void watch (const std::stop_token &stop);

  mutable std::mutex lock_; // protects what follows
  std::condition_variable_any ended_;
  Clock::time_point awake_; // when the thread woke last
  Clock::time_point end_;   // of the last pause
  Clock::duration pause_{};
  std::jthread thread_; // last: it uses the members above
};

} // namespace codedexposure

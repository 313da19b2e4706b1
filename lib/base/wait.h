/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Waits that a request to stop ends. */
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>

namespace codedexposure
{

/** Waits for @p time; false at once when a stop is requested. */
inline bool
wait_for (const std::stop_token &stop, std::chrono::nanoseconds time)
{
  std::mutex lock;
  std::condition_variable_any never;
  std::unique_lock guard (lock);
  never.wait_for (guard, stop, time, [] { return false; });
  return !stop.stop_requested ();
}

} // namespace codedexposure

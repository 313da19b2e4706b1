/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/pause_watch.h"

namespace codedexposure
{

namespace
{
constexpr std::chrono::milliseconds kInterval{100};
}

PauseWatch::PauseWatch ()
    : awake_ (Clock::now ()),
      thread_ ([this] (const std::stop_token &stop) { watch (stop); })
{
}

void
PauseWatch::watch (const std::stop_token &stop)
{
  std::unique_lock guard (lock_);
  while (!stop.stop_requested ()) {
    ended_.wait_for (guard, stop, kInterval, [] { return false; });
    const auto now = Clock::now ();
    if (now - awake_ >= kMinPause) {
      pause_ = now - awake_;
      end_ = now;
    }
    awake_ = now;
  }
}

PauseWatch::Clock::duration
PauseWatch::recent (Clock::duration within) const
{
  const std::lock_guard guard (lock_);
  const auto now = Clock::now ();
  /* The thread may not have had its turn yet. */
  if (now - awake_ >= kMinPause)
    return now - awake_;
  return pause_ > Clock::duration () && now - end_ <= within
             ? pause_
             : Clock::duration ();
}

} // namespace codedexposure

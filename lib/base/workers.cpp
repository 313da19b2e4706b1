/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/workers.h"

#include <algorithm>
#include <system_error>
#include <utility>

namespace codedexposure
{

Workers::Workers (int count)
{
  const int processors =
      std::max (1, int (std::thread::hardware_concurrency ()));
  const int threads = std::clamp (count > 0 ? count : processors, 1, kMost);
  try {
    for (int worker = 1; worker < threads; worker++)
      threads_.emplace_back ([this, worker] (std::stop_token quit) {
        serve (std::move (quit), worker);
      });
  } catch (const std::system_error &) {
    /* The threads that started do all the work. */
  }
}

Workers::~Workers () = default;

bool
Workers::run (int parts, const Task &task, std::stop_token stop)
{
  {
    const std::lock_guard lock (mutex_);
    task_ = &task;
    parts_ = parts;
    stop_ = std::move (stop);
    next_ = 0;
    busy_ = int (threads_.size ());
    round_++;
  }
  begun_.notify_all ();
  work (0);
  std::unique_lock lock (mutex_);
  done_.wait (lock, [this] { return busy_ == 0; });
  if (failure_)
    std::rethrow_exception (std::exchange (failure_, nullptr));
  return !stop_.stop_requested ();
}

void
Workers::serve (std::stop_token quit, int worker)
{
  std::uint64_t seen = 0;
  while (true) {
    {
      std::unique_lock lock (mutex_);
      if (!begun_.wait (lock, quit, [&] { return round_ != seen; }))
        return;
      seen = round_;
    }
    work (worker);
    const std::lock_guard lock (mutex_);
    if (--busy_ == 0)
      done_.notify_one ();
  }
}

void
Workers::work (int worker)
{
  while (!stop_.stop_requested ()) {
    const int part = next_++;
    if (part >= parts_)
      return;
    try {
      (*task_) (part, worker);
    } catch (...) {
      const std::lock_guard lock (mutex_);
      next_ = parts_;
      if (!failure_)
        failure_ = std::current_exception ();
    }
  }
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Memory that is another's, and becomes one's own when it is kept too long. */
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include <gst/gst.h>

#include "gstraii.h"

namespace cexp::gst
{

class Lease;

/** What became of a frame that was kept for longer than its lease. */
struct Overdue {
  guint64 number; ///< as lend () was told
  /** Somebody was reading it, or the copy came so late that the source may have
   * written already: it may show something else. */
  bool spoilt;
};

/**
 * Lends out the memory of a source that writes into it again after a time, as
 * aravissrc does with the buffers of its camera. A buffer that is still there
 * when its time is over gets memory of its own: who maps it after that sees a
 * copy. Those that are gone by then are never copied.
 *
 * Thread-safe; a thread of its own makes the copies.
 */
class LeaseKeeper
{
public:
  /** @p overdue is called on the keeper's thread, with no lock held. */
  explicit LeaseKeeper (std::function<void (const Overdue &)> overdue);
  ~LeaseKeeper ();
  LeaseKeeper (const LeaseKeeper &) = delete;
  LeaseKeeper &operator= (const LeaseKeeper &) = delete;

  /** Puts memory that is lent for @p time, and read-only, in the place of that
   * of @p buffer, which is writable. The source must not write for twice as
   * long. */
  void lend (GstBuffer *buffer, guint64 number, std::chrono::nanoseconds time);
  /** Ends all leases: nobody looks into the source's memory after this. */
  void recall ();

private:
  using Clock = std::chrono::steady_clock;
  struct Entry {
    std::weak_ptr<Lease> lease;
    guint64 number;
    Clock::time_point end;
    Clock::time_point due; ///< when the source may write
  };

  void work ();

  const std::function<void (const Overdue &)> overdue_;
  std::mutex lock_; // covers all below
  std::condition_variable changed_;
  std::deque<Entry> entries_;
  bool quit_ = false;
  std::thread thread_; // last: it uses all of the above
};

} // namespace cexp::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The thread that talks to a DMD. */
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

#include "dmd/dmd.h"

namespace codedexposure
{

/**
 * Controls a Dmd from a thread of its own, so that other threads wait for
 * hardware only in settle () and halt ().
 *
 * A run lasts from upload () to halt (); its jobs are done in the order of the
 * calls. A job that fails parks the mirrors and ends the run. Calls outside a
 * run are ignored. A job that runs out of memory fails like any other.
 * Thread-safe. The destructor halts.
 */
class DmdRunner
{
public:
  /** Called on the runner's thread; they must not call the runner. */
  struct Reports {
    /** Before an upload: its min time. */
    std::function<void (Nanoseconds)> predicted = [] (Nanoseconds) {};
    UploadProgress progress = [] (int, int) {};
    /** A job failed, other than by halt (). */
    std::function<void (const Error &)> failed = [] (const Error &) {};
    /** The run is over, but the device did not acknowledge the stop: its
     * mirrors may still move. */
    std::function<void ()> not_parked = [] {};
  };

  DmdRunner (std::unique_ptr<Dmd> dmd, Reports reports);
  ~DmdRunner ();
  DmdRunner (const DmdRunner &) = delete;
  DmdRunner &operator= (const DmdRunner &) = delete;

  const DmdInfo &info () const { return dmd_->info (); }

  /** Begins a run. */
  void upload (const Schedule &schedule);
  /** Starts, or restarts, from mask 0. */
  void start (const SlotPlan &plan);

  /** Shows @p mask instead, until the schedule is restored. */
  void show (const StillMask &mask, const SlotPlan &plan);
  /** Sends @p schedule once more in the same run, and starts it. */
  void restore (const Schedule &schedule, const SlotPlan &plan);

  /** Whether there is a run and all its jobs are done. */
  bool settled () const
  {
    const std::lock_guard guard (lock_);
    return is_settled ();
  }
  /** Waits for that, at most for @p time. False if the run ended, interrupt ()
   * ended the wait, or the time is over. */
  bool settle (std::chrono::milliseconds time = std::chrono::hours (24 * 365));
  /** Whether a job failed in the last run. */
  bool failed () const
  {
    const std::lock_guard guard (lock_);
    return run_ == Run::failed;
  }
  /** Whether there is no run, before upload () or after halt (). */
  bool halted () const
  {
    const std::lock_guard guard (lock_);
    return run_ == Run::none;
  }
  /** While on, settle () does not wait. */
  void interrupt (bool on);

  /** Ends the run: drops its jobs, cancels the one at work, parks the mirrors,
   * and returns when that is done. */
  void halt ();

private:
  using Job = std::function<Result<void> (std::stop_token)>;
  enum class Run { none, on, failed };

  void ask (Job job);
  void ask_upload (const Schedule &schedule);
  void work ();
  void park (std::unique_lock<std::mutex> &guard);
  void do_next (std::unique_lock<std::mutex> &guard);
  bool idle () const { return jobs_.empty () && !working_ && !parking_; }
  bool is_settled () const { return run_ == Run::on && idle (); }
  bool wait_is_over () const
  {
    return idle () || interrupted_ || run_ != Run::on;
  }

  const std::unique_ptr<Dmd> dmd_; // used by the thread only, but for info ()
  const Reports reports_;

  mutable std::mutex lock_; // covers everything below; held over no job
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  std::stop_source cancel_;
  Run run_ = Run::none;
  bool working_ = false;
  bool parking_ = false; ///< halt () waits for the mirrors to be parked
  bool interrupted_ = false;
  bool quit_ = false;

  std::thread thread_; // last: it uses all of the above
};

} // namespace codedexposure

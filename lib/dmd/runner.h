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
 * Drives a Dmd from a thread of its own, so that no other thread waits for
 * hardware unless it chooses to.
 *
 * A run lasts from upload () to halt (); its jobs are done in the order in
 * which they were asked for. One that fails parks the mirrors and ends the run.
 * What is asked for outside a run is not done. A job that runs out of memory
 * fails like any other. Thread-safe. The destructor halts.
 */
class DmdRunner
{
public:
  /** Called on the runner's thread; they must not call the runner. */
  struct Reports {
    /** Before an upload: how long it is going to take at least. */
    std::function<void (Nanoseconds)> predicted = [] (Nanoseconds) {};
    UploadProgress progress = [] (int, int) {};
    /** A job failed, other than by halt (). */
    std::function<void (const Error &)> failed = [] (const Error &) {};
    /** The run is over, and the device did not answer when it was told to
     * stop: its mirrors may move on. */
    std::function<void ()> not_parked = [] {};
  };

  DmdRunner (std::unique_ptr<Dmd> dmd, Reports reports);
  ~DmdRunner ();
  DmdRunner (const DmdRunner &) = delete;
  DmdRunner &operator= (const DmdRunner &) = delete;

  const DmdInfo &info () const { return dmd_->info (); }

  /** Begins a run. */
  void upload (const Schedule &schedule);
  /** Starts, or starts anew, from mask 0. */
  void start (const SlotPlan &plan);

  /** Shows @p mask instead, until the schedule is restored. */
  void show (const StillMask &mask, const SlotPlan &plan);
  /** Sends @p schedule once more in the same run, and starts it. */
  void restore (const Schedule &schedule, const SlotPlan &plan);

  /** Whether there is a run and all its jobs are done. */
  bool settled () const;
  /** Waits for that. False when the run ended, or interrupt () cut the wait
   * short. */
  bool settle ();
  /** The same, but no longer than @p time. */
  bool settle_within (std::chrono::milliseconds time);
  /** Whether a job failed in the last run. */
  bool failed () const;
  /** Whether there is no run, before upload () or after halt (). */
  bool halted () const;
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

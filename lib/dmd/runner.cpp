/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/runner.h"

#include <new>
#include <utility>

namespace codedexposure
{

namespace
{

/** False when @p function ran out of memory, which must not end the thread. */
template <typename Function>
bool
no_throw (const Function &function)
{
  try {
    function ();
    return true;
  } catch (const std::bad_alloc &) {
    return false;
  }
}

} // namespace

DmdRunner::DmdRunner (std::unique_ptr<Dmd> dmd, Reports reports)
    : dmd_ (std::move (dmd)), reports_ (std::move (reports)),
      thread_ ([this] { work (); })
{
}

DmdRunner::~DmdRunner ()
{
  halt ();
  {
    const std::lock_guard guard (lock_);
    quit_ = true;
  }
  changed_.notify_all ();
  thread_.join ();
}

void
DmdRunner::upload (const Schedule &schedule)
{
  {
    const std::lock_guard guard (lock_);
    if (cancel_.stop_requested ())
      cancel_ = std::stop_source ();
    run_ = Run::on;
    interrupted_ = false;
  }
  ask_upload (schedule);
}

void
DmdRunner::ask_upload (const Schedule &schedule)
{
  ask ([this, schedule] (std::stop_token stop) {
    reports_.predicted (dmd_->upload_time (schedule, stop));
    return dmd_->upload (schedule, stop, reports_.progress);
  });
}

void
DmdRunner::start (const SlotPlan &plan)
{
  ask ([this, plan] (std::stop_token stop) {
    dmd_->stop ();
    return dmd_->start (plan, stop);
  });
}

void
DmdRunner::show (const StillMask &mask, const SlotPlan &plan)
{
  ask ([this, mask, plan] (std::stop_token stop) {
    dmd_->stop ();
    return dmd_->show (mask, plan, stop);
  });
}

void
DmdRunner::restore (const Schedule &schedule, const SlotPlan &plan)
{
  ask_upload (schedule);
  start (plan);
}

void
DmdRunner::ask (Job job)
{
  {
    const std::lock_guard guard (lock_);
    if (run_ != Run::on)
      return;
    jobs_.push_back (std::move (job));
  }
  changed_.notify_all ();
}

bool
DmdRunner::settle (std::chrono::milliseconds time)
{
  std::unique_lock guard (lock_);
  changed_.wait_for (guard, time, [this] { return wait_is_over (); });
  return is_settled () && !interrupted_;
}

void
DmdRunner::interrupt (bool on)
{
  {
    const std::lock_guard guard (lock_);
    interrupted_ = on;
  }
  changed_.notify_all ();
}

void
DmdRunner::halt ()
{
  std::unique_lock guard (lock_);
  run_ = Run::none;
  cancel_.request_stop ();
  jobs_.clear ();
  parking_ = true;
  changed_.notify_all ();
  changed_.wait (guard, [this] { return idle (); });
}

void
DmdRunner::work ()
{
  std::unique_lock guard (lock_);
  while (true) {
    changed_.wait (
        guard, [this] { return quit_ || parking_ || !jobs_.empty (); });
    if (!parking_ && jobs_.empty ())
      return;
    working_ = true;
    if (std::exchange (parking_, false))
      park (guard);
    else
      do_next (guard);
    working_ = false;
    changed_.notify_all ();
  }
}

void
DmdRunner::park (std::unique_lock<std::mutex> &guard)
{
  guard.unlock ();
  no_throw ([this] { dmd_->stop (); });
  no_throw ([this] {
    if (dmd_->running ())
      reports_.not_parked ();
  });
  guard.lock ();
}

void
DmdRunner::do_next (std::unique_lock<std::mutex> &guard)
{
  const Job job = std::move (jobs_.front ());
  jobs_.pop_front ();
  const std::stop_token stop = cancel_.get_token ();
  guard.unlock ();
  Result<void> done;
  if (!no_throw ([&] { done = job (stop); }))
    done = out_of_memory ();
  if (!done) {
    no_throw ([this] { dmd_->stop (); });
    if (!stop.stop_requested ())
      no_throw ([&] { reports_.failed (done.error ()); });
  }
  guard.lock ();
  if (!done && run_ == Run::on) {
    run_ = Run::failed;
    jobs_.clear ();
  }
}

} // namespace codedexposure

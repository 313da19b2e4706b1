/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/frame_sequence.h"

#include <algorithm>

namespace codedexposure
{

namespace
{
constexpr Nanoseconds kRestartAfter = 1'000'000'000;
}

FrameSequence::FrameSequence (FrameRate rate, std::uint64_t first)
    : period_ (rate.period ()), next_number_ (first)
{
}

std::uint64_t
FrameSequence::periods (Nanoseconds span) const
{
  return std::uint64_t ((span + period_ / 2) / period_);
}

void
FrameSequence::resync ()
{
  last_.reset ();
  loss_step_ = 0;
  stepped_back_ = false;
  lost_.clear ();
}

FrameStep
FrameSequence::begin (Nanoseconds time, Arrival arrival)
{
  resync ();
  last_ = time;
  return {.arrival = arrival, .number = next_number_++};
}

FrameStep
FrameSequence::restart (Nanoseconds time)
{
  return begin (time, Arrival::restarted);
}

FrameStep
FrameSequence::take_after (Nanoseconds time, Nanoseconds away)
{
  if (away < period_ / 4 * 3) {
    resync ();
    last_ = time;
    return {.arrival = Arrival::duplicate,
        .number = next_number_ - std::min<std::uint64_t> (next_number_, 1)};
  }
  const std::uint64_t lost = std::max<std::uint64_t> (periods (away), 1) - 1;
  next_number_ += lost;
  FrameStep step = begin (time, lost > 0 ? Arrival::after_loss : Arrival::next);
  step.lost = lost;
  return step;
}

FrameStep
FrameSequence::step_back (Nanoseconds time, Nanoseconds by)
{
  if (stepped_back_ || by > kRestartAfter)
    return restart (time);
  stepped_back_ = true;
  const std::uint64_t newest = next_number_ - 1;
  const std::uint64_t number = newest - std::min (newest, periods (by));
  return {.arrival = lost_.erase (number) > 0 ? Arrival::late : Arrival::behind,
      .number = number};
}

/** Before the frame that comes next; those that are older than a restart never
 * come. */
void
FrameSequence::note_lost (std::uint64_t lost)
{
  const std::uint64_t most = periods (kRestartAfter) + 1;
  const std::uint64_t end = next_number_ + lost;
  lost_.erase (lost_.begin (), lost_.lower_bound (end - std::min (end, most)));
  for (std::uint64_t number = end - std::min (lost, most); number < end;
       number++)
    lost_.insert (number);
}

/** Whether the last frame was late rather than others lost before it, as seen
 * by the @p step to the next one. */
bool
FrameSequence::disproves_loss (Nanoseconds step) const
{
  return loss_step_ > 0 && step < period_ / 4 * 3 &&
         periods (loss_step_ + step) == periods (loss_step_);
}

FrameStep
FrameSequence::take (Nanoseconds time, bool reverse)
{
  if (!last_)
    return begin (time, Arrival::first);

  const Nanoseconds step = reverse ? *last_ - time : time - *last_;
  if (std::max (step, -step) < period_ / 4)
    return {.arrival = Arrival::duplicate, .number = next_number_ - 1};
  if (step < 0)
    return step_back (time, -step);
  last_ = time;
  stepped_back_ = false;
  if (disproves_loss (step) && lost_.erase (next_number_ - 2) > 0) {
    loss_step_ = 0;
    return {.arrival = Arrival::late, .number = next_number_ - 2};
  }

  FrameStep taken{.arrival = Arrival::next};
  loss_step_ = 0;
  if (step > period_ + period_ / 2) {
    taken.arrival = Arrival::after_loss;
    taken.lost = std::max<std::uint64_t> (periods (step), 2) - 1;
    note_lost (taken.lost);
    loss_step_ = step;
  }
  taken.number = next_number_ + taken.lost;
  next_number_ = taken.number + 1;
  return taken;
}

} // namespace codedexposure

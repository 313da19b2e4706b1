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

void
FrameSequence::resync ()
{
  last_.reset ();
  last_was_late_ = false;
}

FrameStep
FrameSequence::restart (Nanoseconds time, Arrival arrival)
{
  last_ = time;
  last_was_late_ = false;
  return {.arrival = arrival, .number = next_number_++};
}

FrameStep
FrameSequence::take_after (Nanoseconds time, std::uint64_t lost)
{
  next_number_ += lost;
  FrameStep step =
      restart (time, lost > 0 ? Arrival::after_loss : Arrival::next);
  step.lost = lost;
  return step;
}

FrameStep
FrameSequence::take (Nanoseconds time, bool reverse)
{
  if (!last_)
    return restart (time, Arrival::first);

  const Nanoseconds step = reverse ? *last_ - time : time - *last_;
  const auto periods = [this] (Nanoseconds span) {
    return std::uint64_t ((span + period_ / 2) / period_);
  };

  if (std::max (step, -step) < period_ / 4)
    return {.arrival = Arrival::duplicate, .number = next_number_ - 1};

  if (step < 0) {
    if (last_was_late_ || -step > kRestartAfter)
      return restart (time, Arrival::restarted);
    last_was_late_ = true;
    const std::uint64_t newest = next_number_ - 1;
    return {.arrival = Arrival::late,
        .number = newest - std::min (newest, periods (-step))};
  }

  FrameStep taken{.arrival = Arrival::next};
  if (step > period_ + period_ / 2) {
    taken.arrival = Arrival::after_loss;
    taken.lost = std::max<std::uint64_t> (periods (step), 2) - 1;
  }
  taken.number = next_number_ + taken.lost;
  next_number_ = taken.number + 1;
  last_ = time;
  last_was_late_ = false;
  return taken;
}

} // namespace codedexposure

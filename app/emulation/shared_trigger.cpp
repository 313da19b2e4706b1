/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/shared_trigger.h"

#include <thread>

namespace codedexposure::app
{

std::optional<Shot>
SharedTrigger::next (const std::optional<std::uint64_t> &last)
{
  /* A camera that is later than this loses exposures. */
  constexpr std::uint64_t kBehind = 4;
  const auto began = [this] {
    const std::lock_guard guard (lock_);
    if (!began_)
      began_ = Clock::now ();
    return *began_;
  }();
  const auto now =
      Nanoseconds (std::chrono::nanoseconds (Clock::now () - began).count ());
  const auto present = std::uint64_t (now / period_);
  std::uint64_t number = last ? *last + 1 : present;
  if (present > number + kBehind)
    number = present;
  if (number > present + 1) {
    std::this_thread::sleep_for (std::chrono::nanoseconds (period_));
    return std::nullopt;
  }
  const Nanoseconds begin = Nanoseconds (number) * period_;
  std::this_thread::sleep_until (
      began + std::chrono::nanoseconds (begin + period_));
  return Shot{.number = number,
      .trigger = begin,
      .begin = begin,
      .end = begin + period_};
}

std::optional<Shot>
TriggeredCamera::shoot (ImageView<std::uint16_t> picture)
{
  const auto shot = trigger_.next (last_);
  if (!shot)
    return std::nullopt;
  last_ = shot->number;
  for (; taken_ <= shot->number; taken_++)
    if (!frames_.take (picture))
      return std::nullopt;
  return shot;
}

} // namespace codedexposure::app

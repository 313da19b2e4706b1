/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A sequence of calls to a driver whose board fails. */
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <random>

#include "dmd_rig.h"

namespace codedexposure::test
{

/** Opens, uploads, starts and stops, whatever fails. */
class FaultLife
{
public:
  using Time = std::chrono::milliseconds;
  using Open = std::function<Result<std::unique_ptr<Dmd>> ()>;

  /** Max duration of a call, without the time for packets: 10 s for a table of
   * a DLPC900, 2 s for each of two stops, and the patience for all the rest. */
  static constexpr Time kLongestCall{16'000};

  /** @p clock  time, without that for which packets are on the wire. */
  FaultLife (std::mt19937 &random, std::function<Time ()> clock)
      : random_ (random), clock_ (std::move (clock))
  {
  }

  /** What @p call returns; its time is noted. */
  template <typename Call>
  auto timed (const Call &call)
  {
    const Time before = clock_ ();
    auto result = call ();
    longest_ = std::max (longest_, clock_ () - before);
    return result;
  }

  /** Faults for up to 3 of the first @p messages messages. */
  void draw (EmulatedHid &board, int messages)
  {
    const int faults = 1 + int (random_ () % 3);
    for (int i = 0; i < faults; i++)
      board.faults[int (random_ () % unsigned (messages))] =
          Fault (1 + random_ () % (kFaults - 1));
  }

  /** @return the driver, still open; null where it could not be opened. */
  std::unique_ptr<Dmd> live (const Open &open, const Schedule &schedule)
  {
    auto opened = timed (open);
    if (!opened)
      return nullptr;
    Dmd &dmd = **opened;
    for (int round = 0; round < 3; round++) {
      std::stop_source stop;
      int until_stop = int (random_ () % 12);
      const auto sent = timed ([&] {
        return dmd.upload (schedule, stop.get_token (), [&] (int, int) {
          if (until_stop-- == 0)
            stop.request_stop ();
        });
      });
      const auto started =
          timed ([&] { return dmd.start (plan_of (schedule)); });
      shown_ += sent.ok () && started.ok ();
      (void)timed ([&] { return dmd.status (); });
      if (random_ () % 2 == 0)
        end (dmd);
    }
    return *std::move (opened);
  }
  void end (Dmd &dmd)
  {
    timed ([&] {
      dmd.stop ();
      return true;
    });
  }
  void close (std::unique_ptr<Dmd> dmd)
  {
    timed ([&] {
      dmd.reset ();
      return true;
    });
  }

  /** Times that masks were shown. */
  int shown () const { return shown_; }
  /** The call that took longest. */
  Time longest () const { return longest_; }

private:
  std::mt19937 &random_;
  const std::function<Time ()> clock_;
  int shown_ = 0;
  Time longest_{0};
};

/** On the wire of a rig that is not open yet. */
template <typename Rig>
FaultLife
life_of (Rig &rig, std::mt19937 &random)
{
  return FaultLife (
      random, [clock = rig.clock] { return clock->now - clock->wire; });
}

} // namespace codedexposure::test

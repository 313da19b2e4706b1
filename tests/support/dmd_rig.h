/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* An emulated board, the connection to it and its driver. */
#pragma once

#include <cstdlib>
#include <memory>

#include <gtest/gtest.h>

#include "dmd/dmd.h"
#include "dmd/hid_link.h"
#include "dmd/options.h"
#include "emulated_pipe.h"

namespace codedexposure::test
{

using OpenDriver = Result<std::unique_ptr<Dmd>> (*) (
    std::unique_ptr<HidLink>, const DmdOptions &);

inline DmdOptions
options_of (std::string_view text)
{
  const auto options =
      DmdOptions::parse ("usb:" + std::string (text) + ",guard=off");
  EXPECT_TRUE (options.ok ()) << options.error ().message;
  return *options;
}

inline Schedule
schedule_of (std::string_view preset)
{
  const auto schedule = Schedule::from_preset (preset);
  EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
  return *schedule;
}

inline SlotPlan
plan_of (const Schedule &schedule, FrameRate rate = {25, 1})
{
  const auto plan = SlotPlan::fit (schedule.timing (), schedule.slots (), rate);
  EXPECT_TRUE (plan.ok ()) << plan.error ().message;
  return *plan;
}

inline void
ignore_progress (int, int)
{
}

/** Number of random fault sequences of a test: FAULT_SEQUENCES, or @p few. */
inline int
fault_sequences (int few = 500)
{
  const char *asked = std::getenv ("FAULT_SEQUENCES");
  return asked != nullptr ? std::atoi (asked) : few;
}

/** "" for a success. */
template <typename T>
std::string
message_of (const Result<T> &result)
{
  return result.ok () ? "" : result.error ().message;
}

template <typename Board, OpenDriver open_driver>
struct DmdRig {
  std::shared_ptr<Board> board;
  std::shared_ptr<EmulatedPipe::Clock> clock =
      std::make_shared<EmulatedPipe::Clock> ();
  std::unique_ptr<Dmd> dmd = {};

  explicit DmdRig (std::shared_ptr<Board> emulated)
      : board (std::move (emulated))
  {
  }

  Result<std::unique_ptr<Dmd>> make (std::string_view options) const
  {
    return open_driver (
        std::make_unique<HidLink> (
            std::make_unique<EmulatedPipe> (board, clock), "board"),
        options_of (options));
  }
  Result<void> open (std::string_view options = "")
  {
    auto opened = make (options);
    if (!opened)
      return opened.error ();
    dmd = *std::move (opened);
    return {};
  }
  Result<void> upload (const Schedule &schedule)
  {
    return dmd->upload (schedule, {}, ignore_progress);
  }
  /** Everything up to running masks, at 25 frames/s. */
  Result<void> show (const Schedule &schedule)
  {
    const auto uploaded = upload (schedule);
    return uploaded ? dmd->start (plan_of (schedule)) : uploaded;
  }
};

} // namespace codedexposure::test

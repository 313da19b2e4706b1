/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Commands that the emulated DLPC900 rejects, and the driver's handling of
 * rejections and faults. */
#include <memory>

#include "dlpc900_rig.h"
#include "dmd/dlpc900_protocol.h"
#include "fault_life.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

using namespace std::chrono_literals;

/** The reply of a board to a write: the error code, 0 for none. */
int
verdict (EmulatedDlpc900 &board, const HidCommand &command, const Bytes &data)
{
  HidLink link (std::make_unique<EmulatedPipe> (
                    std::shared_ptr<EmulatedHid> (&board, [] (auto *) {}),
                    std::make_shared<EmulatedPipe::Clock> ()),
      "board");
  const auto reply = link.write (command, data);
  EXPECT_TRUE (reply.ok ());
  const auto code = link.read (dlpc900::kErrorCode);
  EXPECT_TRUE (code.ok ());
  EXPECT_EQ (reply->refused, code->data.front () != 0);
  return code->data.front ();
}

} // namespace

TEST (EmulatedDlpc900, RefusesWhatTheControllerRefuses)
{
  using namespace dlpc900;
  EmulatedDlpc900 board (kDlp5500);
  const auto line = [] (int index, std::uint32_t exposure,
                        std::uint32_t dark = 0) {
    return encode_entry ({.index = std::uint16_t (index),
        .time = {exposure, dark},
        .plane = {index, 0}});
  };
  EXPECT_EQ (verdict (board, kDefine, line (0, 105)), 5) << "in video mode";
  EXPECT_EQ (verdict (board, kDisplayMode, {kModeOnTheFly}), 0);
  EXPECT_EQ (verdict (board, kRun, {kRunStart}), 5) << "without a table";
  EXPECT_EQ (verdict (board, kDefine, line (0, 104)), 14);
  EXPECT_EQ (verdict (board, kDefine, line (0, 105, 104)), 12);
  EXPECT_EQ (verdict (board, kTriggerIn1, encode_trigger_in (103, false)), 13);
  EXPECT_EQ (verdict (board, kDefine, line (0, 105)), 0);
  EXPECT_EQ (verdict (board, kDefine, line (1, 105)), 0);
  EXPECT_EQ (verdict (board, kConfigure, encode_configuration (3)), 15)
      << "more lines than were sent";
  EXPECT_EQ (verdict (board, kConfigure, encode_configuration (2)), 0);
  EXPECT_EQ (verdict (board, kLoadImage, encode_load (0, 500)), 0);
  EXPECT_EQ (verdict (board, kLoadImage, encode_load (1, 500)), 15)
      << "not from the highest down";
  EXPECT_EQ (verdict (board, kIdle, {0}), 0);
  EXPECT_EQ (verdict (board, kRun, {kRunStart}), 11) << "without images";
  EXPECT_EQ (verdict (board, kRun, {}), 6) << "a wrong length";
  EXPECT_FALSE (board.running ());
}

TEST (Dlpc900Faults, ARefusalIsToldWithItsReason)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.upload (Schedule ())), "");
  const Schedule long_slots = schedule_of ("sequential:2x2");
  const auto plan = SlotPlan::fit ({}, 2, {25, 1});
  EXPECT_EQ (message_of (rig.dmd->start (*plan)),
      "board (DLP5500): the masks are for 4 slots, not for 2");
  rig.board->faults[rig.board->messages ()] = Fault::refuse;
  EXPECT_EQ (message_of (rig.dmd->start (plan_of (long_slots))),
      "board: cannot start or stop the patterns: error 0, 'no'");
}

TEST (Dlpc900Faults, StaleAndLateRepliesAreTakenForWhatTheyAre)
{
  Rig rig;
  for (int message = 0; message < 400; message++)
    rig.board->faults[message] = Fault::stale_reply;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  expect_masks (*rig.board, Schedule ());
}

TEST (Dlpc900Faults, AnUnpluggedBoardIsOneClearErrorAtOnce)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  rig.board->faults[rig.board->messages () + 100] = Fault::unplug;
  const auto before = rig.clock->now;
  EXPECT_EQ (message_of (rig.show (Schedule ())),
      "board was unplugged or switched off; connect it, then open it again");
  rig.dmd->stop ();
  EXPECT_FALSE (rig.dmd->running ());
  EXPECT_LE (rig.clock->now - before, 2s);
}

TEST (Dlpc900Faults, ATableThatIsNotAnsweredForIsGivenUpSoon)
{
  for (const auto &[options, least, most] :
      {std::tuple{"x", 1900ms, 2900ms}, {"x,patience=9s", 8900ms, 9900ms}}) {
    Rig rig;
    ASSERT_EQ (message_of (rig.open (options)), "");
    // Before it: stop and its status, idle, mode and its status, two triggers,
    // and the four lines.
    rig.board->faults[rig.board->messages () + 11] = Fault::lose_reply;
    const auto before = rig.clock->now;
    const std::string message = message_of (rig.upload (Schedule ()));
    EXPECT_NE (
        message.find ("take the pattern table: no reply within"), message.npos)
        << message;
    EXPECT_GE (rig.clock->now - before, least);
    EXPECT_LE (rig.clock->now - before, most);
    EXPECT_FALSE (rig.board->running ());
  }
}

TEST (Dlpc900Faults, AStartIsCancelledWhereverItIs)
{
  for (int message = 0; message < 9; message++) {
    Rig rig;
    ASSERT_EQ (message_of (rig.open ()), "");
    ASSERT_EQ (message_of (rig.upload (Schedule ())), "");
    // The board no longer answers, and a frame lasts 10 s.
    for (int lost = message + 1; lost < 20; lost++)
      rig.board->faults[rig.board->messages () + lost] = Fault::lose_reply;
    std::stop_source stop;
    std::chrono::milliseconds asked{-1};
    rig.clock->on_write = [&, left = message] () mutable {
      if (left-- == 0) {
        stop.request_stop ();
        asked = rig.clock->now;
      }
    };
    const auto started =
        rig.dmd->start (plan_of (Schedule (), {1, 10}), stop.get_token ());
    EXPECT_FALSE (started.ok ()) << message;
    ASSERT_GE (asked, 0ms) << message;
    EXPECT_LE (rig.clock->now - asked, 100ms) << message;
  }
}

TEST (Dlpc900Faults, ABoardThatDoesNotSayThatItStoppedStillRuns)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  for (int attempt = 0; attempt < 2; attempt++)
    rig.board->faults[rig.board->messages () + attempt] = Fault::stall;
  rig.dmd->stop ();
  EXPECT_TRUE (rig.dmd->running ());
  EXPECT_TRUE (rig.board->running ());
  rig.dmd->stop ();
  EXPECT_FALSE (rig.dmd->running ());
  EXPECT_FALSE (rig.board->running ());
}

TEST (Dlpc900Faults, WhateverHappensItStopsInTheEndAndHangsNowhere)
{
  const int kSequences = fault_sequences ();
  const Schedule schedule = schedule_of ("sequential:2x1");
  std::mt19937 random (3);
  int survivors = 0, shown = 0;
  for (int sequence = 0; sequence < kSequences; sequence++) {
    Rig rig;
    FaultLife life = life_of (rig, random);
    life.draw (*rig.board, 200);
    auto dmd =
        life.live ([&] { return rig.make ("x,region=32x16"); }, schedule);
    rig.board->faults.clear (); // the destructor follows
    life.close (std::move (dmd));
    ASSERT_TRUE (rig.board->gone () || !rig.board->running ())
        << "sequence " << sequence;
    ASSERT_LE (life.longest (), FaultLife::kLongestCall)
        << "sequence " << sequence;
    survivors += !rig.board->gone ();
    shown += life.shown ();
  }
  EXPECT_GT (survivors, kSequences / 2);
  EXPECT_LT (survivors, kSequences);
  EXPECT_GT (shown, kSequences / 2);
}

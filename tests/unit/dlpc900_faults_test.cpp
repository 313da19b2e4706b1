/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Commands that the emulated DLPC900 rejects, and the driver's handling of
 * rejections and faults. */
#include <functional>
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
      "board: cannot start or stop the patterns: internal error (error 255), "
      "'no'");
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

/** The message of an upload with the table. Before it: power, stop and its
 * status, idle, mode and its status, two triggers, and the four lines. */
constexpr int kTableMessage = 12;

TEST (Dlpc900Faults, ATableMayTakeTenSecondsAndIsThenGivenUp)
{
  for (const auto &[options, limit] : {std::pair{"x", 10'000ms},
           {"x,patience=300ms", 10'000ms}, {"x,patience=20s", 20'000ms}}) {
    Rig rig;
    ASSERT_EQ (message_of (rig.open (options)), "");
    rig.board->faults[rig.board->messages () + kTableMessage] =
        Fault::lose_reply;
    const auto before = rig.clock->now;
    EXPECT_EQ (message_of (rig.upload (Schedule ())),
        "board: cannot take the pattern table: no reply within " +
            std::to_string (limit.count ()) + " ms");
    EXPECT_GE (rig.clock->now - before, limit);
    EXPECT_LE (rig.clock->now - before, limit + 500ms);
    EXPECT_FALSE (rig.board->running ());
  }
}

/** The board will work for @p time on the message that comes after @p message
 * others; @p then is called when it comes. */
void
work_long (
    Rig &rig, int message, std::chrono::milliseconds time,
    std::function<void ()> then = [] {})
{
  const int number = rig.board->messages () + message;
  rig.clock->on_write = [&rig, number, time, then] {
    if (rig.board->messages () != number)
      return;
    rig.clock->silent_until = rig.clock->now + time;
    then ();
  };
}

TEST (Dlpc900Faults, ATableThatTakesNineSecondsIsWaitedFor)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  work_long (rig, kTableMessage, 9s);
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  EXPECT_GE (rig.clock->now, 9s);
  EXPECT_EQ (rig.board->overlaps (), 0);
  expect_masks (*rig.board, Schedule ());
}

TEST (Dlpc900Faults, AStopWaitsUntilTheBoardHasDoneTheLastCommand)
{
  for (int message = 0; message <= kTableMessage; message++) {
    Rig rig;
    ASSERT_EQ (message_of (rig.open ()), "");
    std::stop_source stop;
    bool asked = false;
    work_long (rig, message, message == kTableMessage ? 9000ms : 1900ms, [&] {
      stop.request_stop ();
      asked = true;
    });
    const auto uploaded =
        rig.dmd->upload (Schedule (), stop.get_token (), ignore_progress);
    EXPECT_FALSE (uploaded.ok ()) << message;
    ASSERT_TRUE (asked) << message;
    rig.dmd->stop ();
    EXPECT_EQ (rig.board->overlaps (), 0) << message;
    EXPECT_FALSE (rig.dmd->running ()) << message;
  }
}

TEST (Dlpc900Faults, AMessageThatWasCutSpoilsNoOther)
{
  for (int message = 0; message < 40; message++) {
    Rig rig;
    ASSERT_EQ (message_of (rig.open ()), "");
    rig.board->faults[rig.board->messages () + message] = Fault::cut;
    const auto shown = rig.show (Schedule ());
    if (shown.ok ()) // all of the message was in the first packet
      expect_masks (*rig.board, Schedule ());
    else
      EXPECT_FALSE (rig.board->running ()) << message;
    ASSERT_EQ (message_of (rig.show (Schedule ())), "") << message;
    expect_masks (*rig.board, Schedule ());
  }
}

TEST (Dlpc900Faults, NoRefusalGoesUnnoticed)
{
  const Schedule schedule = schedule_of ("sequential:4x1");
  Rig whole;
  ASSERT_EQ (message_of (whole.open ()), "");
  const int first = whole.board->messages ();
  ASSERT_EQ (message_of (whole.show (schedule)), "");
  const int messages = whole.board->messages () - first;
  for (int message = 0; message < messages; message++) {
    Rig rig;
    ASSERT_EQ (message_of (rig.open ()), "");
    rig.board->faults[rig.board->messages () + message] = Fault::refuse;
    EXPECT_FALSE (rig.show (schedule).ok ()) << message;
    EXPECT_FALSE (rig.board->running ()) << message;
    EXPECT_FALSE (rig.dmd->running ()) << message;
    ASSERT_EQ (message_of (rig.show (schedule)), "") << message;
    expect_masks (*rig.board, schedule);
  }
}

TEST (Dlpc900Faults, AnOrderThatIsRefusedIsNoticed)
{
  const Schedule other = schedule_of ("sequential:2x2,order=bit-reversal");
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  ASSERT_EQ (message_of (rig.upload (other)), "");
  // Before it: stop and its status, four lines and the table.
  rig.board->faults[rig.board->messages () + 7] = Fault::refuse;
  EXPECT_EQ (message_of (rig.dmd->start (plan_of (other))),
      "board: cannot set the order of patterns: internal error (error 255)");
  EXPECT_FALSE (rig.board->running ());
  ASSERT_EQ (message_of (rig.show (other)), "");
  expect_masks (*rig.board, other);
}

TEST (Dlpc900Faults, ABoardThatIsLeftWithinAMessageIsOpened)
{
  Rig first;
  ASSERT_EQ (message_of (first.open ()), "");
  ASSERT_EQ (message_of (first.show (Schedule ())), "");
  const Bytes message = encode_request (
      HidKind::post, 1, dlpc900::kImageData.word, Bytes (kHidRequestData));
  for (std::size_t packets = 1; packets < message.size () / 64; packets++) {
    // The program is killed while it sends.
    for (std::size_t at = 0; at < 64 * packets; at += 64)
      first.board->out ({message.begin () + std::ptrdiff_t (at),
          message.begin () + std::ptrdiff_t (at + 64)});
    Rig next;
    next.board = first.board;
    EXPECT_EQ (message_of (next.open ()), "") << packets;
    EXPECT_TRUE (first.board->running ()) << "a question disturbs nothing";
  }
}

TEST (Dlpc900Faults, APowerCutDuringAnUploadIsNoticed)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  bool cut = false;
  const auto uploaded =
      rig.dmd->upload (Schedule (), {}, [&] (int sent, int total) {
        if (sent > total / 2 && !cut) {
          rig.board->power_cycle ();
          cut = true;
        }
      });
  EXPECT_EQ (message_of (uploaded),
      "board: cannot upload masks: invalid parameter (error 6)");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  expect_masks (*rig.board, Schedule ());
}

TEST (Dlpc900Faults, AfterAPowerCutTheMasksAreSentAgain)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  rig.board->power_cycle ();
  const auto status = rig.dmd->status ();
  ASSERT_EQ (message_of (status), "");
  EXPECT_FALSE (status->running);
  EXPECT_FALSE (rig.dmd->running ());
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  expect_masks (*rig.board, Schedule ());
}

TEST (Dlpc900Faults, AfterAStartThatFailedTheMasksAreSentAgain)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.upload (Schedule ())), "");
  rig.board->power_cycle ();
  EXPECT_NE (message_of (rig.dmd->start (plan_of (Schedule ()))), "");
  EXPECT_FALSE (rig.dmd->running ());
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  expect_masks (*rig.board, Schedule ());
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

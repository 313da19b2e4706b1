/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The DLPC350 driver with an emulated board: tables for flash and video and for
 * both triggers, limits, and faults. */
#include <random>

#include "dmd/dlpc350_protocol.h"
#include "dmd/drivers.h"
#include "emulated_dlpc350.h"
#include "fault_life.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

struct Rig : DmdRig<EmulatedDlpc350, open_dlpc350> {
  Rig () : DmdRig (std::make_shared<EmulatedDlpc350> ()) {}
};

/** Trigger and plane of each line: "t0 t1" (timer), "r0 n1" (rising, none),
 * with
 * * before which it takes the next image, and _ after which it is black. */
std::string
table (const EmulatedDlpc350 &board)
{
  std::string text;
  for (const auto &line : board.lines ()) {
    if (!text.empty ())
      text += ' ';
    text += "trfn"[line.trigger];
    text += std::to_string (line.plane);
    if (line.next_image)
      text += '*';
    if (line.black_after)
      text += '_';
  }
  return text;
}

} // namespace

TEST (Dlpc350, SaysWhatTheBoardIs)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  const DmdInfo &info = rig.dmd->info ();
  EXPECT_EQ (info.size, (Extent{912, 1140}));
  EXPECT_EQ (info.array, Array::diamond);
  EXPECT_EQ (info.minimum_active, 235'000);
  EXPECT_EQ (info.resident_masks, 48);
  EXPECT_TRUE (info.trigger_in && info.trigger_out);
  EXPECT_EQ (info.patterns->limits.minimum_dark, 230u);
}

TEST (Dlpc350, WithoutImagesSaysWhatTheUserCanDo)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  const std::string message = message_of (rig.upload (Schedule ()));
  for (const char *part : {"takes no masks over USB",
           "codedexposure schedule render", "images=0", "source=video"})
    EXPECT_NE (message.find (part), std::string::npos) << message;
}

TEST (Dlpc350, ImagesMustBeInFlash)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ("x,images=2")), "");
  EXPECT_EQ (message_of (rig.upload (Schedule ())),
      "board (DLP4500) has 2 images in flash, there is no image 2");
}

TEST (Dlpc350, AsMasterRunsOnItsTimer)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ("x,images=1")), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  EXPECT_TRUE (rig.board->running ());
  EXPECT_EQ (table (*rig.board), "t0* t1 t2 t3");
  EXPECT_EQ (rig.board->images (), (Bytes{1}));
  EXPECT_EQ (rig.board->exposure (), 10'000u);
  EXPECT_EQ (rig.board->period (), 10'000u);
  EXPECT_EQ (rig.board->per_trigger (), 4);
  EXPECT_EQ (rig.board->trigger_mode (), 1);
}

TEST (Dlpc350, PulsesCanBeTurnedByEitherBit)
{
  // One board for all: what the last user set does not stay.
  Rig rig;
  for (const auto &[options, bytes] : {std::pair{"x,images=0", Bytes{0, 0xBB}},
           {"x,images=0,pulse=low", {1, 0xBB}},
           {"x,images=0,pulse=low,polarity-bit=1", {2, 0xBB}},
           {"x,images=0", {0, 0xBB}}}) {
    ASSERT_EQ (message_of (rig.open (options)), "");
    ASSERT_EQ (message_of (rig.upload (Schedule ())), "");
    EXPECT_EQ (rig.board->pulse (), bytes) << options;
  }
}

TEST (Dlpc350, ABoardInStandbyIsWoken)
{
  Rig rig;
  rig.board->standby = true;
  ASSERT_EQ (message_of (rig.open ("x,images=0")), "");
  EXPECT_TRUE (rig.board->standby) << "a question leaves it alone";
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  EXPECT_TRUE (rig.board->running ());
}

TEST (Dlpc350, WithTheCameraAsMasterWaitsOnceAFrame)
{
  Rig rig;
  ASSERT_EQ (
      message_of (rig.open ("x,images=0,master=camera,edge=falling")), "");
  const Schedule schedule =
      schedule_of ("sequential:2x2,switching=250us,readout=1ms");
  ASSERT_EQ (message_of (rig.show (schedule)), "");
  EXPECT_EQ (table (*rig.board), "f0* n1 n2 n3_");
  EXPECT_EQ (rig.board->exposure (), 9'500u);
  EXPECT_EQ (rig.board->period (), 9'750u);
}

TEST (Dlpc350, IsBlackBeforeEachFrameThatWaits)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ("x,images=0,master=camera")), "");
  ASSERT_EQ (message_of (
                 rig.show (schedule_of ("sequential:2x1,pilot=8,readout=1ms"))),
      "");
  EXPECT_EQ (table (*rig.board), "r0* n2_ r1 n3_");
}

TEST (Dlpc350, ShowsOneFrameOfVideoPerSequence)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ("x,source=video")), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  EXPECT_EQ (table (*rig.board), "r0* n1 n2 n3");
  EXPECT_EQ (rig.board->source (), 0);
  EXPECT_EQ (rig.board->trigger_mode (), 0);
}

TEST (Dlpc350, TwoImagesFollowTheMasks)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ("x,images=0/1")), "");
  ASSERT_EQ (message_of (rig.show (schedule_of ("sequential:6x5"))), "");
  ASSERT_EQ (rig.board->lines ().size (), 30u);
  EXPECT_TRUE (rig.board->lines ()[24].next_image);
  EXPECT_EQ (rig.board->lines ()[24].plane, 0);
  EXPECT_EQ (rig.board->images (), (Bytes{0, 1}));
}

TEST (Dlpc350, IsToldToStartAgainWhereItIgnoresTheFirst)
{
  Rig rig;
  rig.board->ignores_first_start = true;
  ASSERT_EQ (message_of (rig.open ("x,images=0")), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  EXPECT_TRUE (rig.board->running ());
}

TEST (Dlpc350, StartsAnewAfterAStop)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ("x,images=0")), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  rig.dmd->stop ();
  EXPECT_FALSE (rig.board->running ());
  ASSERT_EQ (message_of (rig.dmd->start (plan_of (Schedule ()))), "");
  EXPECT_TRUE (rig.board->running ());
  rig.dmd.reset ();
  EXPECT_FALSE (rig.board->running ());
}

TEST (EmulatedDlpc350, StartsNothingThatWasNotValidatedOrIsWrong)
{
  using namespace dlpc350;
  const auto board = std::make_shared<EmulatedDlpc350> ();
  HidLink link (std::make_unique<EmulatedPipe> (
                    board, std::make_shared<EmulatedPipe::Clock> ()),
      "board");
  const auto write = [&] (const HidCommand &command, const Bytes &data) {
    const auto reply = link.write (command, data);
    EXPECT_TRUE (reply.ok ());
    return !reply->refused;
  };
  const auto verdict_of = [&] (std::uint32_t exposure, int entries) {
    write (kTimes, encode_times ({exposure, 0}));
    write (kConfigure, encode_configuration (entries, 2, 1));
    write (kValidate, {0});
    for (;;)
      if (const auto said = parse_verdict (link.read (kValidate)->data.at (0));
          !said.busy)
        return said;
  };
  EXPECT_TRUE (write (kDisplayMode, {kModePattern}));
  for (const auto &[mailbox, data] : {std::pair{kMailboxImages, Bytes{0}},
           {kMailboxPatterns, encode_entries ({{.next_image = true}, {}})}}) {
    EXPECT_TRUE (write (kMailbox, {mailbox}));
    EXPECT_TRUE (write (kMailboxData, data));
  }
  EXPECT_TRUE (write (kMailbox, {kMailboxClosed}));
  EXPECT_FALSE (verdict_of (234, 2).good) << "too short";
  EXPECT_FALSE (verdict_of (235, 3).good) << "a wrong count";
  EXPECT_TRUE (write (kRun, {kRunStart}));
  EXPECT_FALSE (board->running ()) << "not validated";
  EXPECT_TRUE (verdict_of (235, 2).good);
  EXPECT_TRUE (write (kRun, {kRunStart}));
  EXPECT_TRUE (board->running ());
  EXPECT_TRUE (write (kRun, {kRunStop}));
  EXPECT_TRUE (write (kRun, {kRunStart}));
  EXPECT_FALSE (board->running ()) << "not validated since it was stopped";
}

TEST (Dlpc350, WithoutAVideoSignalSaysSo)
{
  Rig rig;
  rig.board->video_locked = false;
  ASSERT_EQ (message_of (rig.open ("x,source=video")), "");
  EXPECT_EQ (message_of (rig.show (Schedule ())),
      "board: cannot start the patterns: it does not run; is a 912x1140 signal "
      "on its HDMI input?");
}

TEST (Dlpc350, ABoardThatDoesNotStartDoesNotRun)
{
  Rig rig;
  rig.board->video_locked = false;
  ASSERT_EQ (message_of (rig.open ("x,source=video")), "");
  EXPECT_FALSE (rig.show (Schedule ()).ok ());
  EXPECT_FALSE (rig.dmd->running ());
}

TEST (Dlpc350Faults, ATableThatWasCutSpoilsNoOther)
{
  const Schedule schedule = schedule_of ("sequential:6x5");
  for (int message = 0; message < 30; message++) {
    Rig rig;
    ASSERT_EQ (message_of (rig.open ("x,images=0/1")), "");
    rig.board->faults[rig.board->messages () + message] = Fault::cut;
    (void)rig.show (schedule);
    ASSERT_EQ (message_of (rig.show (schedule)), "") << message;
    EXPECT_EQ (rig.board->lines ().size (), 30u);
  }
}

TEST (Dlpc350Faults, WhateverHappensItStopsInTheEndAndHangsNowhere)
{
  const int kSequences = fault_sequences ();
  const Schedule schedule = schedule_of ("sequential:2x2");
  std::mt19937 random (4);
  int shown = 0;
  for (int sequence = 0; sequence < kSequences; sequence++) {
    Rig rig;
    FaultLife life = life_of (rig, random);
    life.draw (*rig.board, 100);
    auto dmd = life.live ([&] { return rig.make ("x,images=0"); }, schedule);
    rig.board->faults.clear (); // the destructor follows
    life.close (std::move (dmd));
    ASSERT_TRUE (rig.board->gone () || !rig.board->running ())
        << "sequence " << sequence;
    ASSERT_LE (life.longest (), FaultLife::kLongestCall)
        << "sequence " << sequence;
    shown += life.shown ();
  }
  EXPECT_GT (shown, kSequences / 2);
}

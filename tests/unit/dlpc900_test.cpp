/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The DLPC900 driver with an emulated board: received masks, tables for both
 * triggers, and data that is not sent twice. */
#include <chrono>

#include "dlpc900_rig.h"
#include "dmd/dlpc900_protocol.h"
#include "hex.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

using namespace std::chrono_literals;

std::vector<std::uint32_t>
exposures (const EmulatedDlpc900 &board)
{
  std::vector<std::uint32_t> times;
  for (const auto &line : board.shown ())
    times.push_back (line.exposure);
  return times;
}

/** 1 for each mask of which @p flag holds, in the order shown. */
std::string
flags (const EmulatedDlpc900 &board, bool EmulatedDlpc900::Line::*flag)
{
  std::string text;
  for (const auto &line : board.shown ())
    text += line.*flag ? '1' : '0';
  return text;
}

} // namespace

TEST (Dlpc900, SaysWhatTheBoardIs)
{
  Rig rig (kDlp6500);
  ASSERT_EQ (message_of (rig.open ()), "");
  const DmdInfo &info = rig.dmd->info ();
  EXPECT_EQ (info.name, "board (DLP6500)");
  EXPECT_EQ (info.size, (Extent{1920, 1080}));
  EXPECT_EQ (info.minimum_active, 105'000);
  EXPECT_EQ (info.resident_masks, 400);
  EXPECT_TRUE (info.triggers_camera);
  EXPECT_TRUE (info.trigger_in && info.trigger_out);
  EXPECT_EQ (info.patterns->limits.minimum_dark, 105u);
  EXPECT_EQ (info.array, Array::orthogonal);
}

TEST (Dlpc900, OldFirmwareHasTheMinimaOfTheTable)
{
  Rig rig (kDlp6500);
  rig.board->firmware_has_minima = false;
  ASSERT_EQ (message_of (rig.open ()), "");
  EXPECT_EQ (rig.dmd->info ().minimum_active, 105'000);
}

TEST (Dlpc900, UnknownHardwareIsAnError)
{
  Rig rig (9);
  EXPECT_EQ (message_of (rig.open ()),
      "board: cannot open it: hardware type 9 is not a known DMD (1..5)");
}

TEST (Dlpc900, OpeningDisturbsNothing)
{
  Rig first;
  ASSERT_EQ (message_of (first.open ()), "");
  ASSERT_EQ (message_of (first.show (Schedule ())), "");
  {
    Rig second;
    second.board = first.board;
    ASSERT_EQ (message_of (second.open ()), "");
    EXPECT_TRUE (second.dmd->status ()->running);
  }
  EXPECT_TRUE (first.board->running ());
}

TEST (Dlpc900, DestructorStopsAndLetsTheMirrorsMove)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  EXPECT_TRUE (rig.board->running ());
  EXPECT_FALSE (rig.board->idle ());
  rig.dmd.reset ();
  EXPECT_FALSE (rig.board->running ());
  EXPECT_TRUE (rig.board->idle ());
}

/** Stripes of one and a half rows and columns, so that nothing repeats. */
StillMask
stripes (int slots, int first = 0)
{
  return {.name = "stripes",
      .on = [] (int x, int y) { return (x * 2 / 3 + y * 2 / 3) % 2 == 0; },
      .slots = slots,
      .first = first};
}

TEST (Dlpc900, AStillMaskStandsInItsSlotsOfEveryExposure)
{
  const Schedule schedule;
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_TRUE (rig.dmd->info ().still_masks);
  ASSERT_EQ (message_of (rig.show (schedule)), "");
  for (const int slots : {1, 3, 4}) {
    ASSERT_EQ (
        message_of (rig.dmd->show (stripes (slots), plan_of (schedule), {})),
        "");
    EXPECT_TRUE (rig.board->running ());
    const auto lines = rig.board->shown ();
    ASSERT_EQ (lines.size (), 1u);
    EXPECT_EQ (lines[0].exposure, 10'000u * unsigned (slots));
    EXPECT_EQ (lines[0].exposure + lines[0].dark, 40'000u);
    EXPECT_TRUE (lines[0].pulses);
    const auto mirrors = rig.board->mirrors (0);
    for (int y = 0; y < mirrors.height (); y++)
      for (int x = 0; x < mirrors.width (); x++)
        ASSERT_EQ (mirrors.at (x, y), stripes (1).on (x, y));
  }
}

TEST (Dlpc900, AStillMaskCanComeLaterInTheExposure)
{
  for (const char *options : {"", "x,master=camera"}) {
    const bool slave = options[0] != '\0';
    const Schedule schedule =
        schedule_of (slave ? "sequential:2x2,readout=400us" : "sequential:2x2");
    Rig rig;
    ASSERT_EQ (message_of (rig.open (options)), "");
    ASSERT_EQ (
        message_of (rig.dmd->show (stripes (2, 1), plan_of (schedule), {})),
        "");
    EXPECT_TRUE (rig.board->running ());
    EXPECT_EQ (exposures (*rig.board),
        slave ? (std::vector<std::uint32_t>{9900, 19800})
              : (std::vector<std::uint32_t>{10'000, 20'000}));
    EXPECT_EQ (rig.board->shown ()[1].dark, slave ? 9900u : 10'000u);
    EXPECT_EQ (flags (*rig.board, &EmulatedDlpc900::Line::pulses),
        slave ? "11" : "10");
    EXPECT_EQ (
        flags (*rig.board, &EmulatedDlpc900::Line::waits), slave ? "10" : "00");
    const auto dark = rig.board->mirrors (0), light = rig.board->mirrors (1);
    for (int y = 0; y < light.height (); y++)
      for (int x = 0; x < light.width (); x++) {
        ASSERT_EQ (dark.at (x, y), 0);
        ASSERT_EQ (light.at (x, y), stripes (1).on (x, y));
      }
  }
}

TEST (Dlpc900, AStillMaskThatIsTooShortIsRefusedAndChangesNothing)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  const auto plan = SlotPlan::fit ({}, 400, {25, 1});
  ASSERT_TRUE (plan.ok ());
  EXPECT_EQ (message_of (rig.dmd->show (stripes (1, 9), *plan, {})),
      "board (DLP5500): stripes in slot 9 of 400 is on for 100us, the DMD "
      "does that for 105us at least; use other slots");
  EXPECT_TRUE (rig.board->running ());
  expect_masks (*rig.board, Schedule ());
}

TEST (Dlpc900, AStillMaskIsRenderedOnce)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  int asked = 0;
  const StillMask counted{.name = "counted",
      .on =
          [&] (int, int) {
            asked++;
            return true;
          },
      .slots = 1};
  ASSERT_EQ (
      message_of (rig.dmd->show (counted, plan_of (Schedule ()), {})), "");
  const Extent size = rig.dmd->info ().size;
  EXPECT_EQ (asked, size.width * size.height);
}

TEST (Dlpc900, AfterAStillMaskTheScheduleIsSentOnceMore)
{
  const Schedule schedule;
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (schedule)), "");
  ASSERT_EQ (
      message_of (rig.dmd->show (stripes (1), plan_of (schedule), {})), "");
  ASSERT_EQ (message_of (rig.show (schedule)), "");
  expect_masks (*rig.board, schedule);
  EXPECT_TRUE (rig.board->running ());
}

TEST (Dlpc900, AfterALaterStillMaskTheSamePlanesAreSentOnceMore)
{
  const Schedule schedule = schedule_of ("sequential:2x1,order=1/0");
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (
      message_of (rig.dmd->show (stripes (1, 1), plan_of (schedule), {})), "");
  ASSERT_EQ (message_of (rig.show (schedule)), "");
  expect_masks (*rig.board, schedule);
}

TEST (Dlpc900, AStillMaskStartsInTheRegion)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open (",region=96x64+16+8")), "");
  EXPECT_EQ (rig.dmd->info ().shown (), (Extent{96, 64}));
  ASSERT_EQ (
      message_of (rig.dmd->show (stripes (1), plan_of (Schedule ()), {})), "");
  const auto mirrors = rig.board->mirrors (0);
  for (int y = 0; y < mirrors.height (); y++)
    for (int x = 0; x < mirrors.width (); x++) {
      const bool in = x >= 16 && x < 112 && y >= 8 && y < 72;
      ASSERT_EQ (mirrors.at (x, y), in && stripes (1).on (x - 16, y - 8))
          << x << ", " << y;
    }
}

class Dlpc900Masks : public ::testing::TestWithParam<const char *>
{
};

TEST_P (Dlpc900Masks, ArriveMirrorByMirror)
{
  const Schedule schedule = schedule_of (GetParam ());
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (schedule)), "");
  expect_masks (*rig.board, schedule);
  EXPECT_TRUE (rig.board->running ());
}

INSTANTIATE_TEST_SUITE_P (OfSchedules, Dlpc900Masks,
    ::testing::Values ("sequential:2x2", "staircase:3x2,pilot=16",
        "sequential:lattice:8/3,order=bit-reversal", "s-matrix:7x1",
        "sequential:8x8,order=bit-reversal"));

TEST (Dlpc900, TwoControllersGetHalfTheColumnsEach)
{
  Rig rig (kDlp9000);
  const Schedule schedule = schedule_of ("sequential:3x1");
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (schedule)), "");
  expect_masks (*rig.board, schedule);
}

TEST (Dlpc900, MirrorsOutsideTheRegionAreOff)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ("x,region=101x50+7+20")), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  expect_masks (
      *rig.board, Schedule (), {MirrorLayout::address, Rect{7, 20, 101, 50}});
}

TEST (Dlpc900, AsMasterItPulsesOnceAFrame)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (
      message_of (rig.show (schedule_of ("sequential:2x2,pilot=8"))), "");
  EXPECT_EQ (exposures (*rig.board), (std::vector<std::uint32_t> (8, 10'000)));
  EXPECT_EQ (flags (*rig.board, &EmulatedDlpc900::Line::pulses), "10001000");
  EXPECT_EQ (flags (*rig.board, &EmulatedDlpc900::Line::waits), "00000000");
}

/** The last table, one string for each line. */
std::string
last_table (EmulatedDlpc900 &board, std::size_t lines)
{
  const auto &sent = board.writes[0x1A34];
  std::string text;
  for (std::size_t i = sent.size () - lines; i < sent.size (); i++)
    text += to_hex (sent[i]) + "\n";
  return text + to_hex (board.writes[0x1A31].back ());
}

TEST (Dlpc900, TablesAreThoseOfTheDocumentation)
{
  Rig master;
  ASSERT_EQ (message_of (master.open ()), "");
  ASSERT_EQ (message_of (master.show (Schedule ())), "");
  EXPECT_EQ (last_table (*master.board, 3),
      "01 00 10 27 00 71 00 00 00 01 00 08\n"
      "02 00 10 27 00 71 00 00 00 01 00 10\n"
      "03 00 10 27 00 71 00 00 00 01 00 18\n"
      "04 00 00 00 00 00");
  EXPECT_EQ (to_hex (master.board->writes[0x1A1E].back ()), "00 00 00 14 00");

  Rig slave;
  ASSERT_EQ (message_of (slave.open ("x,master=camera")), "");
  ASSERT_EQ (
      message_of (slave.show (schedule_of ("sequential:2x2,readout=211us"))),
      "");
  EXPECT_EQ (last_table (*slave.board, 4),
      "00 00 DB 26 00 F1 00 00 00 00 00 00\n"
      "01 00 DB 26 00 71 00 00 00 00 00 08\n"
      "02 00 DB 26 00 71 00 00 00 00 00 10\n"
      "03 00 DC 26 00 71 00 00 00 00 00 18\n"
      "04 00 00 00 00 00");
  EXPECT_EQ (to_hex (slave.board->writes[0x1A35].back ()), "69 00 00");
}

TEST (Dlpc900, PulsesCanBeTurned)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ("x,pulse=low")), "");
  ASSERT_EQ (message_of (rig.upload (schedule_of ("sequential:4x1"))), "");
  EXPECT_EQ (to_hex (rig.board->writes[0x1A1E].back ()), "01 14 00 00 00");
}

TEST (Dlpc900, WithTheCameraAsMasterItWaitsOnceAFrame)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ("x,master=camera")), "");
  EXPECT_FALSE (rig.dmd->info ().triggers_camera);
  ASSERT_EQ (
      message_of (rig.show (schedule_of ("sequential:2x2,readout=400us"))), "");
  EXPECT_EQ (flags (*rig.board, &EmulatedDlpc900::Line::waits), "1000");
  EXPECT_EQ (exposures (*rig.board),
      (std::vector<std::uint32_t>{9900, 9900, 9900, 9900}));
  const auto full = rig.dmd->start (plan_of (Schedule ()));
  EXPECT_NE (message_of (full).find ("readout=211us"), std::string::npos)
      << message_of (full);
}

TEST (Dlpc900, AfterAStopAWholeFrameIsDark)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  rig.dmd->stop ();
  EXPECT_FALSE (rig.board->running ());
  const auto stopped = rig.clock->now;
  ASSERT_EQ (message_of (rig.dmd->start (plan_of (Schedule ()))), "");
  EXPECT_GE (rig.clock->now - stopped, 40ms);
}

TEST (Dlpc900, ABoardInStandbyIsWoken)
{
  Rig rig;
  rig.board->standby = true;
  ASSERT_EQ (message_of (rig.open ()), "");
  EXPECT_TRUE (rig.board->standby) << "a question leaves it alone";
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  EXPECT_TRUE (rig.board->running ());
}

TEST (Dlpc900, TheTriggerDelayIsNotBelowThatOfTheUnit)
{
  for (const auto &[minimum, bytes] :
      {std::pair{62u, "69 00 00"}, {105u, "69 00 00"}, {110u, "6E 00 00"}}) {
    Rig rig;
    rig.board->minimum = minimum;
    ASSERT_EQ (message_of (rig.open ()), "");
    ASSERT_EQ (message_of (rig.upload (Schedule ())), "");
    EXPECT_EQ (to_hex (rig.board->writes[0x1A35].back ()), bytes);
  }
  Rig rig;
  rig.board->minimum = 110;
  EXPECT_EQ (message_of (rig.open ("x,trigger-delay=105us")),
      "board (DLP5500): trigger-delay is 105us; use 110us to 65535us");
}

TEST (Dlpc900, FirmwareThatLocksMirrorsIsParkedOnce)
{
  Rig rig;
  rig.board->firmware_major = 4;
  rig.board->firmware_minor = 2;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  EXPECT_EQ (rig.board->park_cycles (), 1);
}

TEST (Dlpc900Upload, TellsTimeAndProgress)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  const Schedule columns = schedule_of ("sequential:4x1");
  const Nanoseconds predicted = rig.dmd->upload_time (columns);
  std::vector<std::pair<int, int>> told;
  const auto before = rig.clock->now;
  ASSERT_TRUE (
      rig.dmd
          ->upload (columns, {},
              [&] (int sent, int total) { told.emplace_back (sent, total); })
          .ok ());
  ASSERT_GE (told.size (), 10u);
  EXPECT_EQ (told.front ().first, 0);
  EXPECT_EQ (told.back ().first, told.back ().second);
  EXPECT_EQ (Nanoseconds (told.back ().second) * 1'000'000, predicted);
  for (std::size_t i = 1; i < told.size (); i++)
    EXPECT_GT (told[i].first, told[i - 1].first);
  // A packet takes 1 ms; the rest is tables and their replies.
  const auto spent = rig.clock->now - before;
  EXPECT_GE (spent, std::chrono::nanoseconds (predicted));
  EXPECT_LE (spent, std::chrono::nanoseconds (predicted) + 100ms);
}

TEST (Dlpc900Upload, TheSameMasksAreNotSentAgain)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  ASSERT_EQ (rig.board->images_received (), 1);
  const Schedule slower = schedule_of ("sequential:2x2,active=5ms");
  EXPECT_EQ (rig.dmd->upload_time (slower), 0);
  std::vector<std::pair<int, int>> told;
  ASSERT_TRUE (
      rig.dmd
          ->upload (slower, {},
              [&] (int sent, int total) { told.emplace_back (sent, total); })
          .ok ());
  EXPECT_EQ (told, (std::vector<std::pair<int, int>>{{0, 1}, {1, 1}}));
  ASSERT_EQ (message_of (rig.show (slower)), "");
  EXPECT_EQ (rig.board->images_received (), 1);
  expect_masks (*rig.board, slower);
}

TEST (Dlpc900Upload, AnotherOrderOfTheSameMasksMovesLinesOnly)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  for (const char *preset : {"sequential:2x2,order=bit-reversal",
           "sequential:2x2,phase=1/1", "sequential:2x2"}) {
    const Schedule schedule = schedule_of (preset);
    EXPECT_EQ (rig.dmd->upload_time (schedule), 0);
    ASSERT_EQ (message_of (rig.show (schedule)), "") << preset;
    EXPECT_EQ (rig.board->images_received (), 1) << preset;
    expect_masks (*rig.board, schedule);
    EXPECT_EQ (flags (*rig.board, &EmulatedDlpc900::Line::pulses), "1000");
  }
}

/* The black before a mask that waits for the camera belongs to a line of the
 * table: an order that shows another line there would have light while it
 * waits, and black within the exposure. */
TEST (Dlpc900Upload, BlackComesBeforeTheMaskThatWaitsInEveryOrder)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ("x,master=camera")), "");
  const std::pair<const char *, int> orders[] = {
      {"sequential:2x2,readout=400us", 1},
      {"sequential:2x2,readout=400us,order=bit-reversal", 1},
      {"sequential:2x2,readout=400us,phase=1/1", 2},
      {"sequential:2x2,readout=400us", 3},
      {"sequential:2x2,readout=400us,order=3/0/1/2", 3}};
  for (const auto &[preset, images] : orders) {
    const Schedule schedule = schedule_of (preset);
    ASSERT_EQ (message_of (rig.show (schedule)), "") << preset;
    expect_masks (*rig.board, schedule);
    EXPECT_EQ (flags (*rig.board, &EmulatedDlpc900::Line::waits), "1000");
    EXPECT_EQ (flags (*rig.board, &EmulatedDlpc900::Line::black_after), "0001")
        << preset;
    EXPECT_EQ (rig.board->images_received (), images) << preset;
  }
  const Schedule pilot = schedule_of ("sequential:2x2,readout=400us,pilot=8");
  ASSERT_EQ (message_of (rig.show (pilot)), "");
  EXPECT_EQ (
      flags (*rig.board, &EmulatedDlpc900::Line::black_after), "00010001");
}

/* 8 masks, then 12 of which some come twice. */
TEST (Dlpc900Upload, TakesTheMasksOfAllRegions)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  for (const char *region : {"sequential:4x2", "sequential:3x2"}) {
    const Schedule schedule =
        schedule_of ("sequential:2x2,region=24x12+8+4:" + std::string (region));
    ASSERT_EQ (message_of (rig.show (schedule)), "") << region;
    expect_masks (*rig.board, schedule);
  }
}

TEST (Dlpc900Upload, OldFirmwareKnowsNoOrder)
{
  Rig rig;
  rig.board->firmware_major = 4;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  const Schedule other = schedule_of ("sequential:2x2,order=bit-reversal");
  ASSERT_EQ (message_of (rig.show (other)), "");
  expect_masks (*rig.board, other);
}

TEST (Dlpc900Upload, OtherMasksAreSent)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  const Schedule stairs = schedule_of ("staircase:2x2");
  EXPECT_GT (rig.dmd->upload_time (stairs), 0);
  ASSERT_EQ (message_of (rig.show (stairs)), "");
  expect_masks (*rig.board, stairs);
}

TEST (Dlpc900Upload, IsCancelledWithinAFewMessages)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  std::stop_source stop;
  std::chrono::milliseconds asked{0};
  const auto cancelled = rig.dmd->upload (
      Schedule (), stop.get_token (), [&] (int sent, int total) {
        if (sent > total / 2 && !stop.stop_requested ()) {
          stop.request_stop ();
          asked = rig.clock->now;
        }
      });
  EXPECT_EQ (message_of (cancelled), "board (DLP5500): upload cancelled");
  EXPECT_LE (rig.clock->now - asked, 100ms);
  EXPECT_EQ (message_of (rig.dmd->start (plan_of (Schedule ()))),
      "board (DLP5500): no masks to start; upload first");
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  expect_masks (*rig.board, Schedule ());
}

TEST (Dlpc900Upload, AfterOneThatWasCancelledBeginsFromTheStart)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  std::stop_source stop;
  const auto cancelled = rig.dmd->upload (
      Schedule (), stop.get_token (), [&] (int sent, int total) {
        if (sent > total / 2)
          stop.request_stop ();
      });
  EXPECT_NE (message_of (cancelled), "");
  rig.board->power_cycle ();
  ASSERT_EQ (message_of (rig.show (Schedule ())), "");
  EXPECT_TRUE (rig.board->running ());
  expect_masks (*rig.board, Schedule ());
}

TEST (Dlpc900Upload, MoreMasksThanItHoldsAreAnError)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  EXPECT_EQ (message_of (rig.upload (schedule_of ("sequential:15x15,pilot=8"))),
      "board (DLP5500) holds 400 masks, the schedule "
      "sequential:15x15,pilot=8 has 450; use a tile with fewer elements");
}

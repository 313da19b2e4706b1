/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The DMD interface, its simulated device and the mirrors behind it. */
#include <thread>

#include <gtest/gtest.h>

#include "dmd/dmd.h"
#include "dmd/simulated_dmd.h"

using namespace codedexposure;

namespace
{

const FrameRate kRate{25, 1};

Schedule
raster_schedule (int columns, int rows, int pilot_rows = 0)
{
  const int n = columns * rows;
  return *Schedule::make ({.tile = *Tile::raster (columns, rows),
      .code = *Code::named ("sequential", n),
      .pilot_rows = pilot_rows});
}

SlotPlan
plan_of (const Schedule &schedule)
{
  return *SlotPlan::fit (schedule.timing (), schedule.slots (), kRate);
}

/** Masks in @p slots slots from @p first on; -1 while parked. */
std::vector<int>
masks_shown (SimulatedMirrors &mirrors, std::int64_t first, int slots)
{
  std::vector<int> masks;
  for (int s = 0; s < slots; s++)
    masks.push_back (mirrors.mask_in_slot (first + s).value_or (-1));
  return masks;
}

void
ignore_progress (int, int)
{
}

} // namespace

TEST (SimulatedMirrors, AreParkedUntilStarted)
{
  SimulatedMirrors mirrors;
  EXPECT_EQ (mirrors.mask_in_slot (0), std::nullopt);
  mirrors.program (Schedule ());
  EXPECT_EQ (mirrors.mask_in_slot (0), std::nullopt);
  EXPECT_FALSE (mirrors.running ());
}

TEST (SimulatedMirrors, CycleThroughTheMasksFromTheFirstExposure)
{
  SimulatedMirrors mirrors;
  mirrors.program (Schedule ());
  mirrors.start ();
  EXPECT_EQ (masks_shown (mirrors, 0, 10),
      (std::vector{0, 1, 2, 3, 0, 1, 2, 3, 0, 1}));
}

TEST (SimulatedMirrors, StartedInMidExposureWaitForTheNext)
{
  SimulatedMirrors mirrors;
  mirrors.program (Schedule ());
  masks_shown (mirrors, 0, 2);
  mirrors.start ();
  EXPECT_EQ (masks_shown (mirrors, 2, 6), (std::vector{-1, -1, 0, 1, 2, 3}));
}

/* The second one waits for the first. */
TEST (SimulatedMirrors, AreSeenAlikeByTwoCameras)
{
  const auto mirrors = std::make_shared<SimulatedMirrors> ();
  std::optional<SimulatedMirrors::View> on (std::in_place, mirrors, true);
  SimulatedMirrors::View off (mirrors, false);
  const auto masks = [] (SimulatedMirrors::View &view, int first, int count) {
    std::vector<int> seen;
    for (int s = first; s < first + count; s++)
      seen.push_back (view.mask_in_slot (s).value_or (-1));
    return seen;
  };
  mirrors->program (Schedule ());
  std::vector<int> seen;
  std::jthread second ([&] { seen = masks (off, 0, 16); });
  EXPECT_EQ (masks (*on, 0, 4), (std::vector{-1, -1, -1, -1}));
  mirrors->start ();
  EXPECT_EQ (masks (*on, 4, 4), (std::vector{0, 1, 2, 3}));
  mirrors->hold ({.name = "all", .on = [] (int, int) { return true; }}, 4);
  mirrors->start ();
  const auto change = masks (*on, 8, 4);
  EXPECT_EQ (change, (std::vector{-1, -1, -1, -1}));
  const auto all = masks (*on, 12, 4);
  EXPECT_TRUE (on->held ());
  second.join ();
  EXPECT_EQ (std::vector (seen.begin () + 4, seen.begin () + 8),
      (std::vector{0, 1, 2, 3}));
  EXPECT_EQ (std::vector (seen.begin () + 8, seen.begin () + 12), change);
  EXPECT_EQ (std::vector (seen.begin () + 12, seen.end ()), all);
  EXPECT_EQ (off.held (), on->held ());
  /* Alone, it does not wait. */
  on.reset ();
  EXPECT_EQ (masks (off, 16, 4), all);
}

TEST (SimulatedMirrors, PilotMasksFollowTheParityOfTheFrame)
{
  SimulatedMirrors mirrors;
  mirrors.program (raster_schedule (2, 1, 8));
  masks_shown (mirrors, 0, 2);
  mirrors.start ();
  EXPECT_EQ (masks_shown (mirrors, 2, 6), (std::vector{2, 3, 0, 1, 2, 3}));
}

TEST (SimulatedMirrors, SlipLateAndEarly)
{
  SimulatedMirrors mirrors;
  mirrors.program (Schedule ());
  mirrors.start ();
  mirrors.slip_at (6, 1);
  mirrors.slip_at (9, -2);
  EXPECT_EQ (masks_shown (mirrors, 0, 12),
      (std::vector{0, 1, 2, 3, 0, 1, 1, 2, 3, 2, 3, 0}));
}

TEST (SimulatedMirrors, RestartMendsASlipAfterOneDarkExposure)
{
  SimulatedMirrors mirrors;
  mirrors.program (Schedule ());
  mirrors.start ();
  mirrors.slip_at (1, 1);
  EXPECT_EQ (masks_shown (mirrors, 0, 5), (std::vector{0, 0, 1, 2, 3}));
  mirrors.stop ();
  mirrors.start ();
  EXPECT_EQ (masks_shown (mirrors, 5, 11),
      (std::vector{-1, -1, -1, -1, -1, -1, -1, 0, 1, 2, 3}));
}

TEST (SimulatedMirrors, ADarkExposureIsNotOwedTwice)
{
  SimulatedMirrors mirrors;
  mirrors.program (Schedule ());
  mirrors.start ();
  masks_shown (mirrors, 0, 4);
  mirrors.stop ();
  EXPECT_EQ (masks_shown (mirrors, 4, 4), (std::vector{-1, -1, -1, -1}));
  mirrors.start ();
  EXPECT_EQ (masks_shown (mirrors, 8, 2), (std::vector{0, 1}));
}

TEST (SimulatedMirrors, AreSharedByNameWhileSomebodyHoldsThem)
{
  const auto held = SimulatedMirrors::find ("shared");
  held->program (Schedule ());
  EXPECT_EQ (SimulatedMirrors::find ("shared"), held);
  EXPECT_NE (SimulatedMirrors::find ("other"), held);
  SimulatedMirrors::find ("brief")->program (Schedule ());
  EXPECT_FALSE (SimulatedMirrors::find ("brief")->schedule ());
}

class SimulatedDmd : public ::testing::Test
{
};

TEST (OpenDmd, NamesTheDevicesThereAre)
{
  const auto opened = open_dmd ("tape:1-2");
  ASSERT_FALSE (opened);
  EXPECT_NE (opened.error ().message.find ("tape:1-2"), std::string::npos);
  EXPECT_NE (opened.error ().message.find ("sim:NAME"), std::string::npos);
}

TEST (OpenDmd, TellsWhichOptionCannotBeUsed)
{
  for (const char *bad :
      {"sim:", "sim:,size=2x2", "sim:b,size=2", "sim:b,size=0x3",
          "sim:b,slip-at=", "sim:b,slip-at=4:", "sim:b,slip-at=-1",
          "sim:b,slip-at=9,slip-at=4", "sim:b,fail=never", "sim:b,colour=red",
          "sim:b,masks=0", "sim:b,min-active=9", "sim:b,"}) {
    SCOPED_TRACE (bad);
    const auto opened = open_dmd (bad);
    ASSERT_FALSE (opened);
    EXPECT_NE (opened.error ().message.find (bad), std::string::npos);
  }
}

TEST (OpenDmd, ReadsTheOptionsOfASimulatedDevice)
{
  const auto dmd = open_dmd ("sim:options,size=1920x1080,masks=400,"
                             "min-active=105us,min-switching=20us");
  ASSERT_TRUE (dmd) << dmd.error ().message;
  const DmdInfo &info = (*dmd)->info ();
  EXPECT_EQ (info.name, "sim:options");
  EXPECT_EQ (info.size, (Extent{1920, 1080}));
  EXPECT_EQ (info.resident_masks, 400);
  EXPECT_EQ (info.minimum_active, 105'000);
  EXPECT_EQ (info.minimum_switching, 20'000);
}

TEST_F (SimulatedDmd, ProgramsStartsAndParksItsMirrors)
{
  const auto mirrors = SimulatedMirrors::find ("life");
  {
    const auto dmd = *open_dmd ("sim:life,slip-at=5:-1");
    std::vector<int> sent;
    ASSERT_TRUE (dmd->upload (
        Schedule (), {}, [&] (int masks, int) { sent.push_back (masks); }));
    EXPECT_EQ (sent, (std::vector{0, 1, 2, 3, 4}));
    EXPECT_FALSE (dmd->running ());
    ASSERT_TRUE (dmd->start (plan_of (Schedule ())));
    EXPECT_TRUE (mirrors->running ());
    EXPECT_EQ (
        masks_shown (*mirrors, 0, 7), (std::vector{0, 1, 2, 3, 0, 2, 3}));
  }
  EXPECT_FALSE (mirrors->running ());
}

TEST_F (SimulatedDmd, CannotStartWithoutMasks)
{
  const auto dmd = *open_dmd ("sim:empty");
  EXPECT_FALSE (dmd->start (plan_of (Schedule ())));
}

TEST_F (SimulatedDmd, ShowsOneMaskWithoutTheOthers)
{
  const auto dmd = open_dmd ("sim:alone");
  ASSERT_TRUE (dmd);
  const auto mirrors = SimulatedMirrors::find ("alone");
  const StillMask first{
      .name = "first", .on = [] (int, int) { return true; }, .slots = 2};
  ASSERT_TRUE ((*dmd)->show (first, plan_of (Schedule ()), {}));
  EXPECT_EQ (masks_shown (*mirrors, 0, 4),
      (std::vector{kStillMask, kStillMask, kOffMask, kOffMask}));
  EXPECT_FALSE ((*dmd)->start (plan_of (Schedule ()), {}));
}

TEST_F (SimulatedDmd, TakesNoMaskIfItIsToldSo)
{
  const auto dmd = open_dmd ("sim:fixed,still=no");
  ASSERT_TRUE (dmd);
  const auto shown =
      (*dmd)->show ({.name = "all", .on = [] (int, int) { return true; }},
          plan_of (Schedule ()), {});
  ASSERT_FALSE (shown);
  EXPECT_EQ (shown.error ().code, ErrorCode::unsupported);
}

TEST_F (SimulatedDmd, FailsWhereItIsAskedTo)
{
  const SlotPlan plan = plan_of (Schedule ());
  EXPECT_FALSE (open_dmd ("sim:fails,fail=open"));
  EXPECT_FALSE ((*open_dmd ("sim:fails,fail=upload"))
                    ->upload (Schedule (), {}, ignore_progress));

  const auto starts = *open_dmd ("sim:fails,fail=start");
  ASSERT_TRUE (starts->upload (Schedule (), {}, ignore_progress));
  EXPECT_FALSE (starts->start (plan));

  const auto restarts = *open_dmd ("sim:fails-again,fail=restart");
  ASSERT_TRUE (restarts->upload (Schedule (), {}, ignore_progress));
  EXPECT_TRUE (restarts->start (plan));
  EXPECT_FALSE (restarts->start (plan));
}

TEST_F (SimulatedDmd, UploadEndsWhenToldToStop)
{
  const auto dmd = *open_dmd ("sim:slow,mask-time=3000s");
  std::stop_source stop;
  std::thread stopper;
  const auto uploaded =
      dmd->upload (Schedule (), stop.get_token (), [&] (int sent, int) {
        if (sent == 0)
          stopper = std::thread ([&] { stop.request_stop (); });
      });
  stopper.join ();
  EXPECT_FALSE (uploaded);
  EXPECT_FALSE (SimulatedMirrors::find ("slow")->schedule ());
}

TEST (CheckLimits, TellsTheNumbersOnBothSides)
{
  const Schedule schedule = raster_schedule (16, 16);
  const SlotPlan plan = plan_of (schedule);
  const DmdInfo fits{
      .name = "d", .minimum_active = plan.active (), .resident_masks = 256};
  EXPECT_TRUE (check_limits (fits, schedule, plan));

  DmdInfo slow = fits;
  slow.minimum_active += 100'000;
  const auto too_short = check_limits (slow, schedule, plan);
  ASSERT_FALSE (too_short);
  EXPECT_NE (too_short.error ().message.find ("256 slots need 256.25us"),
      std::string::npos)
      << too_short.error ().message;
  EXPECT_NE (
      too_short.error ().message.find ("leaves 156.25us"), std::string::npos);

  DmdInfo lazy = fits;
  lazy.minimum_switching = 20'000;
  EXPECT_FALSE (check_limits (lazy, schedule, plan));

  DmdInfo small = fits;
  small.resident_masks = 255;
  EXPECT_FALSE (check_limits (small, schedule, plan));
}

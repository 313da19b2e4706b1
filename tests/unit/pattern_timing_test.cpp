/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Slots in whole microseconds, within the limits of controllers and triggers.
 */
#include <gtest/gtest.h>

#include "dmd/boards.h"

using namespace codedexposure;

namespace
{

const PatternLimits kLimits = find_board ("dlp6500")->limits;
const PatternRule kMaster{kLimits, Master::dmd};
const PatternRule kSlave{kLimits, Master::camera};

SlotPlan
plan (const Timing &timing, int slots, FrameRate rate = {25, 1})
{
  const auto fitted = SlotPlan::fit (timing, slots, rate);
  EXPECT_TRUE (fitted.ok ()) << fitted.error ().message;
  return *fitted;
}

using Times = std::vector<PatternTime>;

} // namespace

TEST (PatternTiming, EqualSlotsFillTheFrame)
{
  EXPECT_EQ (*fit_patterns (plan ({}, 4), kMaster),
      (Times{{10000, 0}, {10000, 0}, {10000, 0}, {10000, 0}}));
}

TEST (PatternTiming, RoundingErrorsDoNotAddUp)
{
  const auto times = fit_patterns (plan ({}, 4, {30000, 1001}), kMaster);
  EXPECT_EQ (*times, (Times{{8341, 0}, {8342, 0}, {8341, 0}, {8342, 0}}));
}

TEST (PatternTiming, SwitchingIsDarkWhereTheControllerCanKeepIt)
{
  const Timing bench{.active = 9'800'000, .switching = 200'000};
  EXPECT_EQ (*fit_patterns (plan (bench, 4), kMaster),
      (Times{{9800, 200}, {9800, 200}, {9800, 200}, {9800, 200}}));
  const Timing quick{.switching = 20'000};
  EXPECT_EQ (*fit_patterns (plan (quick, 4), kMaster),
      (Times{{10000, 0}, {10000, 0}, {10000, 0}, {10000, 0}}));
}

TEST (PatternTiming, ReadoutIsDarkAfterTheLastMask)
{
  const Timing timing{.readout = 400'000};
  EXPECT_EQ (*fit_patterns (plan (timing, 4), kMaster),
      (Times{{9900, 0}, {9900, 0}, {9900, 0}, {9900, 400}}));
}

TEST (PatternTiming, MasksThatAreTooShortAreRefusedWithTheNumbers)
{
  EXPECT_TRUE (fit_patterns (plan ({}, 256), kMaster).ok ());
  EXPECT_EQ (fit_patterns (plan ({}, 256, {60, 1}), kMaster).error ().message,
      "each of 256 slots lasts 65us, the DMD shows a mask for 105us at least; "
      "use fewer slots or a lower frame rate");
}

TEST (PatternTiming, MasksThatAreTooLongAreRefused)
{
  EXPECT_FALSE (fit_patterns (plan ({}, 2, {1, 60}), kMaster).ok ());
}

TEST (PatternTiming, CameraMasterNeedsTimeForItsTrigger)
{
  const auto full = fit_patterns (plan ({}, 4), kSlave);
  ASSERT_FALSE (full.ok ());
  EXPECT_EQ (full.error ().message,
      "with the camera as master, the masks take 40ms and the trigger 105us + "
      "105us, more than the 40ms of a frame; give the schedule readout=211us "
      "more, or let the DMD be master");
  const Timing timing{.readout = 211'000};
  const auto fits = fit_patterns (plan (timing, 4), kSlave);
  ASSERT_TRUE (fits.ok ()) << fits.error ().message;
  EXPECT_EQ (*fits, (Times{{9947, 0}, {9947, 0}, {9947, 0}, {9948, 0}}));
}

TEST (EqualPatternTiming, RoundsDown)
{
  const auto time = fit_equal_patterns (plan ({}, 4, {30000, 1001}), kMaster);
  EXPECT_EQ (*time, (PatternTime{8341, 0}));
}

TEST (EqualPatternTiming, AsMasterKnowsNoPause)
{
  const Timing timing{.readout = 400'000};
  EXPECT_FALSE (fit_equal_patterns (plan (timing, 4), kMaster).ok ());
  EXPECT_EQ (
      *fit_equal_patterns (plan (timing, 4), kSlave), (PatternTime{9900, 0}));
}

namespace
{

StillTimes
still (const SlotPlan &plan, int first, int slots,
    const PatternRule &rule = kMaster)
{
  const auto times = fit_still (
      plan, {.name = "light", .on = {}, .slots = slots, .first = first}, rule);
  EXPECT_TRUE (times.ok ()) << times.error ().message;
  return times ? *times : StillTimes{};
}

std::string
refused (const SlotPlan &plan, int first, int slots)
{
  const auto times = fit_still (plan,
      {.name = "light", .on = {}, .slots = slots, .first = first}, kMaster);
  return times ? "" : times.error ().message;
}

const Timing kBench{.active = 9'800'000, .switching = 200'000};

} // namespace

TEST (StillTiming, AMaskInTheFirstSlotsIsDarkInTheOthers)
{
  const SlotPlan bench = plan (kBench, 4);
  EXPECT_EQ (still (bench, 0, 1), (StillTimes{0, {9800, 30200}}));
  EXPECT_EQ (still (bench, 0, 3), (StillTimes{0, {29800, 10200}}));
  PatternRule rule = kMaster;
  for (const auto &[least, lit] :
      {std::pair{105u, 39800u}, {200u, 39800u}, {201u, 40000u}}) {
    rule.limits.minimum_dark = least;
    EXPECT_EQ (still (bench, 0, 4, rule), (StillTimes{0, {lit, 40000 - lit}}))
        << least;
  }
}

TEST (StillTiming, ALaterMaskComesAfterDarkTimeAndFillsThePeriod)
{
  EXPECT_EQ (still (plan ({}, 4), 1, 2), (StillTimes{10000, {20000, 10000}}));
  EXPECT_EQ (still (plan ({}, 4), 3, 1), (StillTimes{30000, {10000, 0}}));
  EXPECT_EQ (
      still (plan (kBench, 4), 2, 1), (StillTimes{20000, {9800, 10200}}));
  const SlotPlan odd = plan ({}, 7, {30000, 1001});
  for (int first = 0; first < 7; first++) {
    const StillTimes times = still (odd, first, 1);
    EXPECT_EQ (times.before + times.lit.exposure + times.lit.dark, 33366u);
    EXPECT_EQ (times.before, odd.start (first) / 1000);
  }
}

TEST (StillTiming, SlotsMayBeShorterThanAMask)
{
  const SlotPlan fine = plan ({}, 2000);
  EXPECT_EQ (still (fine, 7, 6), (StillTimes{140, {120, 39740}}));
  EXPECT_EQ (refused (fine, 7, 5),
      "light in slots 7 to 11 of 2000 is on for 100us, the DMD does that for "
      "105us at least; use other slots");
  EXPECT_EQ (refused (fine, 5, 10),
      "light in slots 5 to 14 of 2000 is off before its light for 100us, the "
      "DMD does that for 105us at least; use other slots");
  EXPECT_EQ (refused (fine, 1985, 10),
      "light in slots 1985 to 1994 of 2000 is off after its light for 100us, "
      "the DMD does that for 105us at least; use other slots");
}

TEST (StillTiming, SlotsThatThePlanDoesNotHaveAreRefused)
{
  EXPECT_EQ (refused (plan ({}, 4), 3, 2),
      "light in slots 3 to 4 does not fit an exposure of slots 0 to 3");
  EXPECT_NE (refused (plan ({}, 4), -1, 2), "");
  EXPECT_NE (refused (plan ({}, 4), 0, 0), "");
}

TEST (StillTiming, WithTheCameraAsMasterItLeavesTimeForTheTrigger)
{
  const SlotPlan roomy = plan ({.readout = 400'000}, 4);
  EXPECT_EQ (still (roomy, 1, 1, kSlave), (StillTimes{9900, {9900, 19800}}));
  EXPECT_EQ (still (roomy, 3, 1, kSlave), (StillTimes{29700, {9900, 0}}));
  EXPECT_FALSE (
      fit_still (plan ({}, 4), {.name = "light", .on = {}}, kSlave).ok ());
}

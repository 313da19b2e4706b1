/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Slots in whole microseconds, within the limits of controllers and triggers.
 */
#include <gtest/gtest.h>

#include "dmd/pattern_timing.h"

using namespace codedexposure;

namespace
{

/** A DLP6500. */
const PatternLimits kLimits{.minimum_exposure = 105,
    .maximum_exposure = 0xFFFFFF,
    .minimum_dark = 105,
    .trigger_delay = 105,
    .trigger_dark = 105};

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
  EXPECT_EQ (*fit_patterns (plan ({}, 4), kLimits, Master::dmd),
      (Times{{10000, 0}, {10000, 0}, {10000, 0}, {10000, 0}}));
}

TEST (PatternTiming, RoundingErrorsDoNotAddUp)
{
  const auto times =
      fit_patterns (plan ({}, 4, {30000, 1001}), kLimits, Master::dmd);
  EXPECT_EQ (*times, (Times{{8341, 0}, {8342, 0}, {8341, 0}, {8342, 0}}));
}

TEST (PatternTiming, SwitchingIsDarkWhereTheControllerCanKeepIt)
{
  const Timing bench{.active = 9'800'000, .switching = 200'000};
  EXPECT_EQ (*fit_patterns (plan (bench, 4), kLimits, Master::dmd),
      (Times{{9800, 200}, {9800, 200}, {9800, 200}, {9800, 200}}));
  const Timing quick{.switching = 20'000};
  EXPECT_EQ (*fit_patterns (plan (quick, 4), kLimits, Master::dmd),
      (Times{{10000, 0}, {10000, 0}, {10000, 0}, {10000, 0}}));
}

TEST (PatternTiming, ReadoutIsDarkAfterTheLastMask)
{
  const Timing timing{.readout = 400'000};
  EXPECT_EQ (*fit_patterns (plan (timing, 4), kLimits, Master::dmd),
      (Times{{9900, 0}, {9900, 0}, {9900, 0}, {9900, 400}}));
}

TEST (PatternTiming, MasksThatAreTooShortAreRefusedWithTheNumbers)
{
  EXPECT_TRUE (fit_patterns (plan ({}, 256), kLimits, Master::dmd).ok ());
  EXPECT_EQ (fit_patterns (plan ({}, 256, {60, 1}), kLimits, Master::dmd)
                 .error ()
                 .message,
      "each of 256 slots lasts 65us, the DMD shows a mask for 105us at least; "
      "use fewer slots or a lower frame rate");
}

TEST (PatternTiming, MasksThatAreTooLongAreRefused)
{
  EXPECT_FALSE (
      fit_patterns (plan ({}, 2, {1, 60}), kLimits, Master::dmd).ok ());
}

TEST (PatternTiming, CameraMasterNeedsTimeForItsTrigger)
{
  const auto full = fit_patterns (plan ({}, 4), kLimits, Master::camera);
  ASSERT_FALSE (full.ok ());
  EXPECT_EQ (full.error ().message,
      "with the camera as master, the masks take 40ms and the trigger 105us + "
      "105us, more than the 40ms of a frame; give the schedule readout=211us "
      "more, or let the DMD be master");
  const Timing timing{.readout = 211'000};
  const auto fits = fit_patterns (plan (timing, 4), kLimits, Master::camera);
  ASSERT_TRUE (fits.ok ()) << fits.error ().message;
  EXPECT_EQ (*fits, (Times{{9947, 0}, {9947, 0}, {9947, 0}, {9948, 0}}));
}

TEST (EqualPatternTiming, RoundsDown)
{
  const auto time =
      fit_equal_patterns (plan ({}, 4, {30000, 1001}), kLimits, Master::dmd);
  EXPECT_EQ (*time, (PatternTime{8341, 0}));
}

TEST (EqualPatternTiming, AsMasterKnowsNoPause)
{
  const Timing timing{.readout = 400'000};
  EXPECT_FALSE (
      fit_equal_patterns (plan (timing, 4), kLimits, Master::dmd).ok ());
  EXPECT_EQ (*fit_equal_patterns (plan (timing, 4), kLimits, Master::camera),
      (PatternTime{9900, 0}));
}

TEST (PatternTiming, OneMaskInTheFirstSlotsIsDarkInTheOthers)
{
  const Times times{{9800, 200}, {9800, 200}, {9800, 200}, {9800, 200}};
  EXPECT_EQ (first_patterns (times, 1, 105), (PatternTime{9800, 30200}));
  EXPECT_EQ (first_patterns (times, 3, 105), (PatternTime{29800, 10200}));
  EXPECT_EQ (first_patterns (times, 4, 105), (PatternTime{39800, 200}));
  EXPECT_EQ (first_patterns (times, 4, 200), (PatternTime{39800, 200}));
  EXPECT_EQ (first_patterns (times, 4, 201), (PatternTime{40000, 0}));
  EXPECT_EQ (first_patterns (times, 4, 300), (PatternTime{40000, 0}));
}

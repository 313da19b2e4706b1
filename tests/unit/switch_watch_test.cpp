/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The first frame that shows the new pattern of a DMD. */
#include <gtest/gtest.h>

#include "sync/switch_watch.h"

using namespace codedexposure;

namespace
{

constexpr double kLight = 100.0, kHalf = 50.0, kDark = 1.0;

/** A watch that has seen frames of a schedule and waits for a pattern. */
SwitchWatch
switching (bool gap_shows = false)
{
  SwitchWatch watch (gap_shows);
  EXPECT_TRUE (watch.take (true, kLight, false));
  watch.begin ();
  return watch;
}

} // namespace

TEST (SwitchWatch, TheFrameAfterTheDarkOneShowsIt)
{
  SwitchWatch watch = switching ();
  EXPECT_FALSE (watch.take (false, kLight, false));
  EXPECT_FALSE (watch.take (true, kLight, false)); // still on its way
  EXPECT_FALSE (watch.take (true, kDark, false));
  EXPECT_TRUE (watch.take (true, kHalf, false));
  EXPECT_TRUE (watch.take (true, kDark, false)); // until something else comes
}

TEST (SwitchWatch, NothingIsShownBeforeTheDeviceIsDone)
{
  SwitchWatch watch = switching ();
  EXPECT_FALSE (watch.take (false, kDark, false));
  for (int i = 0; i < 100; i++)
    ASSERT_FALSE (watch.take (false, kHalf, false));
  EXPECT_TRUE (watch.take (true, kHalf, false));
}

TEST (SwitchWatch, AGapShowsItWhereTheDmdTriggersTheCamera)
{
  SwitchWatch triggers = switching (true);
  EXPECT_TRUE (triggers.take (true, kHalf, true));
  SwitchWatch loses = switching (false);
  EXPECT_FALSE (loses.take (true, kHalf, true));
}

TEST (SwitchWatch, TheBlackLevelOfTheCameraIsNoLight)
{
  constexpr double kBlack = 64;
  SwitchWatch watch (false, kBlack);
  EXPECT_TRUE (watch.take (true, kBlack + 10, false));
  watch.begin ();
  EXPECT_FALSE (watch.take (true, kBlack + 10, false));
  EXPECT_FALSE (watch.take (true, kBlack + 0.5, false));
  EXPECT_TRUE (watch.take (true, kBlack + 8, false));
}

TEST (SwitchWatch, WhatIsDarkItselfIsBelievedInTheEnd)
{
  SwitchWatch watch = switching ();
  for (int i = 0; i < SwitchWatch::kPatience; i++)
    ASSERT_FALSE (watch.take (true, kDark, false)) << i;
  EXPECT_TRUE (watch.take (true, kDark, false));
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The bench in real time: what the driver makes a board show is what the camera
 * sees. */
#include <cmath>

#include <gtest/gtest.h>

#include "emulation/live_bench.h"
#include "dlpc900_rig.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

StillMask
light_in (int first, int slots)
{
  return {.name = "light",
      .on = [] (int, int) { return true; },
      .slots = slots,
      .first = first};
}

SickBenchOptions
small_bench ()
{
  SickBenchOptions options;
  options.camera = {64, 48};
  options.rate = {100, 1};
  return options;
}

double
mean_of (const Image<std::uint16_t> &picture)
{
  double sum = 0.0;
  for (int y = 0; y < picture.height (); y++)
    for (int x = 0; x < picture.width (); x++)
      sum += picture.at (x, y);
  return sum / picture.width () / picture.height ();
}

} // namespace

TEST (LiveBench, TheLinesOfTheTableAreStretchesOfTime)
{
  Rig rig;
  ASSERT_EQ (message_of (rig.open ()), "");
  ASSERT_EQ (
      message_of (rig.dmd->show (light_in (1, 2), plan_of (Schedule ()), {})),
      "");
  const MirrorProgram still = program_of (*rig.board);
  EXPECT_EQ (still.period, 40'000'000);
  EXPECT_EQ (still.periods, 1);
  ASSERT_EQ (still.stretches.size (), 2u);
  EXPECT_EQ (still.stretches[1].begin, 10'000'000);
  EXPECT_EQ (still.stretches[1].end, 30'000'000);
  EXPECT_EQ (still.masks[0]->at (5, 5), 0);
  EXPECT_EQ (still.masks[1]->at (5, 5), 1);

  ASSERT_EQ (
      message_of (rig.show (schedule_of ("sequential:2x2,pilot=8"))), "");
  const MirrorProgram masks = program_of (*rig.board);
  EXPECT_EQ (masks.period, 40'000'000);
  EXPECT_EQ (masks.periods, 2);
  EXPECT_EQ (masks.stretches.size (), 8u);
}

TEST (LiveBench, TheCameraSeesWhatTheBoardShows)
{
  auto bench = LiveBench::make (small_bench (), kDlp5500);
  ASSERT_TRUE (bench.ok ()) << bench.error ().message;
  Rig rig;
  rig.board = (*bench)->board ();
  ASSERT_EQ (message_of (rig.open ()), "");
  Image<std::uint16_t> picture (64, 48);
  EXPECT_FALSE ((*bench)->take (picture.view ())) << "no trigger yet";

  /* Frames of what was shown before come first. */
  const auto comes_to = [&] (double level) {
    for (int frame = 0; frame < 1000; frame++) {
      const auto shot = (*bench)->take (picture.view ());
      if (shot && std::abs (mean_of (picture) - level) < 3)
        return true;
    }
    return false;
  };
  const SlotPlan plan = plan_of (Schedule (), {100, 1});
  for (const int slots : {4, 2, 1}) {
    ASSERT_EQ (message_of (rig.dmd->show (light_in (0, slots), plan, {})), "");
    /* The exposure lacks 50 us at its begin and its end. */
    EXPECT_TRUE (comes_to (4 + 0.8 * 251 * slots / 4)) << slots;
  }
  const auto first = (*bench)->take (picture.view ());
  const auto second = (*bench)->take (picture.view ());
  ASSERT_TRUE (first && second);
  EXPECT_EQ (second->number, first->number + 1) << "none is left out";
  ASSERT_EQ (message_of (rig.dmd->show (light_in (0, 4), plan, {})), "");
  (*bench)->expose (2'000'000);
  EXPECT_TRUE (comes_to (4 + 0.8 * 251 * 2.0 / 9.9));
  rig.dmd->stop ();
  while ((*bench)->take (picture.view ()))
    ;
  EXPECT_FALSE ((*bench)->take (picture.view ()));
}

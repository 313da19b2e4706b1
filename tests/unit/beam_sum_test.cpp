/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The sum of both beams is the picture of an ordinary exposure. */
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "extract/beam_sum.h"
#include "two_beams.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;
using namespace codedexposure::test::two_beams;

constexpr BeamLevels kLevels{
    .on_white = 255.0, .off_white = 255.0, .sum_white = 255.0};
constexpr Extent kSize{96, 64};

/* What an ordinary camera sees of the slots of frame @frame, 0 to 255. */
double
exposure_of (const Pictures &slots, int count, int frame, int x, int y)
{
  double sum = 0.0;
  for (int s = 0; s < count; s++)
    sum += slots[std::size_t (frame * count + s)].at (x, y);
  return sum / count;
}

Image<std::uint8_t>
sum_of (const Schedule &schedule, const Image<std::uint8_t> &on,
    const Image<std::uint8_t> &off, const BeamLevels &levels = kLevels,
    double ratio = 0.0, double *used = nullptr)
{
  Image<std::uint8_t> sum (on.width (), on.height () - schedule.pilot_rows ());
  const double found =
      BeamSum (schedule, {on.width (), on.height ()}, ratio)
          .add<std::uint8_t> (on.view (), off.view (), levels, sum.view ());
  if (used)
    *used = found;
  return sum;
}

/* Leakage takes from one camera what it gives to the other. */
TEST (BeamSum, HasAllLightOfTheExposureWhateverTheMasksWere)
{
  for (const char *preset :
      {"sequential:lattice:4/2", "sequential:2x2,leak=0.05",
          "sequential:lattice:8/3,order=bit-reversal",
          "sequential:lattice:4/2,pilot=4"}) {
    SCOPED_TRACE (preset);
    const Schedule schedule = schedule_of (preset);
    const int n = schedule.slots ();
    const Pictures slots = moving_clouds (kSize, 2 * n, 1.5);
    const Pictures on = coded (schedule, slots);
    const Pictures off = coded (schedule.complement ().value (), slots);
    for (const int frame : {0, 1}) {
      const auto sum =
          sum_of (schedule, on[std::size_t (frame)], off[std::size_t (frame)]);
      double squares = 0.0, light = 0.0, truth = 0.0;
      for (int y = 0; y < sum.height (); y++)
        for (int x = 0; x < sum.width (); x++) {
          light += sum.at (x, y);
          truth += exposure_of (slots, n, frame, x, y);
        }
      for (int y = 0; y < sum.height (); y++)
        for (int x = 0; x < sum.width (); x++)
          squares += std::pow (sum.at (x, y) * truth / light -
                                   exposure_of (slots, n, frame, x, y),
              2);
      const double pixels = double (sum.width ()) * sum.height ();
      EXPECT_LT (std::sqrt (squares / pixels), 0.6); // rounding, three times
      EXPECT_NEAR (light / truth, 1.0, 0.06);
    }
  }
}

/* Mirrors that one camera does not see tell nothing of the light of both. */
TEST (BeamSum, IsBlackWhereACameraSeesNothing)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const Pictures slots = moving_clouds (kSize, 4, 1.5);
  const auto on = coded (schedule, slots)[0];
  auto off = coded (schedule.complement ().value (), slots)[0];
  double all = 0.0;
  const auto whole = sum_of (schedule, on, off, kLevels, 0.0, &all);
  Image<std::uint8_t> seen (kSize.width, kSize.height);
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++) {
      seen.at (x, y) = x >= 30;
      off.at (x, y) = x >= 30 ? off.at (x, y) : 0;
    }
  Image<std::uint8_t> sum (kSize.width, kSize.height);
  const double ratio =
      BeamSum (schedule, kSize, 0.0, seen)
          .add<std::uint8_t> (on.view (), off.view (), kLevels, sum.view ());
  EXPECT_NEAR (ratio / all, 1.0, 0.01);
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++)
      ASSERT_NEAR (sum.at (x, y), x >= 30 ? whole.at (x, y) : 0, 1);
}

TEST (BeamSum, HasTheNoiseOfAnOrdinaryCamera)
{
  constexpr double kFullWell = 10000, kReadNoise = 5;
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const Pictures slots (4 * 4, moving_clouds (kSize, 1, 0.0)[0]);
  BenchOptions first, second;
  first.full_well = second.full_well = kFullWell;
  first.read_noise = second.read_noise = kReadNoise;
  second.seed = first.seed + 1;
  const Pictures on = coded (schedule, slots, first);
  const Pictures off = coded (schedule.complement ().value (), slots, second);
  std::mt19937 random (3);
  double of_sum = 0.0, of_ordinary = 0.0;
  for (std::size_t frame = 0; frame < on.size (); frame++) {
    const auto sum =
        sum_of (schedule, on[frame], off[frame], kLevels, 1.0 / 3.0);
    for (int y = 0; y < sum.height (); y++)
      for (int x = 0; x < sum.width (); x++) {
        const double light = slots[0].at (x, y);
        std::poisson_distribution<int> photons (
            std::max (1e-9, light / 255.0 * kFullWell));
        std::normal_distribution<double> read (0.0, kReadNoise);
        const double seen = std::clamp (
            std::round ((photons (random) + read (random)) / kFullWell * 255.0),
            0.0, 255.0);
        of_sum += std::pow (sum.at (x, y) - light, 2);
        of_ordinary += std::pow (seen - light, 2);
      }
  }
  EXPECT_LT (10 * std::log10 (of_sum / of_ordinary), 0.1); // dB
}

TEST (BeamSum, MeasuresHowMuchMoreTheSecondCameraGets)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const Pictures slots = moving_clouds (kSize, 4, 1.0);
  const Pictures on = coded (schedule, slots);
  const Pictures off = coded (schedule.complement ().value (), slots);
  /* The simulated second camera is as bright with three slots of light as the
   * first one with one; a level without light is no light. */
  Image<std::uint8_t> raised = off[0];
  for (int y = 0; y < raised.height (); y++)
    for (int x = 0; x < raised.width (); x++)
      raised.at (x, y) = std::uint8_t (raised.at (x, y) / 2 + 20);
  double ratio = 0.0;
  sum_of (schedule, on[0], off[0], kLevels, 0.0, &ratio);
  EXPECT_NEAR (ratio, 1.0 / 3.0, 0.01);
  BeamLevels levels = kLevels;
  levels.off_black = 19.75; // halves are rounded down
  const auto sum = sum_of (schedule, on[0], raised, levels, 0.0, &ratio);
  EXPECT_NEAR (ratio, 1.0 / 6.0, 0.005);
  const auto plain = sum_of (schedule, on[0], off[0]);
  for (int y = 0; y < sum.height (); y++)
    for (int x = 0; x < sum.width (); x++)
      EXPECT_NEAR (sum.at (x, y), plain.at (x, y), 3.0);
  sum_of (schedule, on[0], off[0], kLevels, 0.7, &ratio);
  EXPECT_EQ (ratio, 0.7);
  const Image<std::uint8_t> black (kSize.width, kSize.height);
  sum_of (schedule, black, black, kLevels, 0.0, &ratio);
  EXPECT_EQ (ratio, 1.0);
}

TEST (BeamSum, WhatSaturatesACameraIsWhite)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  Image<std::uint8_t> on (kSize.width, kSize.height), off = on;
  for (int y = 0; y < on.height (); y++)
    for (int x = 0; x < on.width (); x++)
      on.at (x, y) = off.at (x, y) = 100;
  on.at (3, 4) = 255;
  off.at (5, 6) = 255;
  BeamLevels levels = kLevels;
  levels.on_white = 245.0; // a black level of 10
  on.at (7, 8) = 245;
  const auto sum = sum_of (schedule, on, off, levels, 1.0 / 3.0);
  EXPECT_EQ (sum.at (3, 4), 255);
  EXPECT_EQ (sum.at (5, 6), 255);
  EXPECT_EQ (sum.at (7, 8), 255);
  EXPECT_EQ (sum.at (0, 0), 104); // of 245 in each of four slots
}

} // namespace

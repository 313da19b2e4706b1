/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the camera, the lamp and the target do, found by what is seen alone. */
#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "base/statistics.h"
#include "checked_bench.h"
#include "doctor/picture.h"
#include "doctor/response.h"
#include "doctor/stack.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

/** All checks until one fails; the first diagnosis of that, else of the first
 * that warns. */
std::string
examined (const SickBenchOptions &options)
{
  auto rig = SimulatedRig::make (options);
  EXPECT_TRUE (rig) << (rig ? "" : rig.error ().message);
  Examination examination{**rig};
  examination.exhibits = false;
  std::string warned;
  for (const Check &check : all_checks ()) {
    if (check.name == "whole")
      continue;
    const auto finding = check.run (examination);
    EXPECT_TRUE (finding) << check.name;
    if (!finding || finding->diagnoses.empty ())
      continue;
    const std::string said = check.name + " " + finding->diagnoses[0].id;
    if (finding->verdict () == Verdict::fail)
      return said;
    if (finding->verdict () == Verdict::warn && warned.empty ())
      warned = said;
  }
  return warned;
}

struct Fault {
  const char *words;
  const char *said; ///< the check may be left out
};

class WithoutFeatures : public testing::TestWithParam<Fault>
{
};

/* The camera has no feature that tells of its settings. */
TEST_P (WithoutFeatures, IsNamedByWhatIsSeen)
{
  for (int seed = 1; seed <= bench_count (2); seed++) {
    const std::string words = std::string (GetParam ().words) + " mute";
    const std::string said = examined (sick_bench (seed, words));
    EXPECT_TRUE (said.ends_with (GetParam ().said))
        << words << " of bench " << seed << ": " << said;
  }
}

INSTANTIATE_TEST_SUITE_P (Camera, WithoutFeatures,
    testing::Values (Fault{"gamma=0.45", "trigger gamma"},
        Fault{"gamma=0.9", "trigger gamma"},
        Fault{"gamma=2.2", "trigger gamma"},
        Fault{"nonlinear=0.05", "sensor nonlinear"},
        Fault{"auto-gain", "trigger auto-gain"},
        Fault{"auto-exposure", "trigger auto-exposure"},
        Fault{"rolling-shutter=8ms", "trigger rolling-shutter"},
        Fault{"rolling-shutter=1500us", "trigger rolling-shutter"},
        Fault{"test-image", "trigger test-image"},
        Fault{"low-bits", "trigger low-bits"},
        Fault{"rate-limit", "trigger half-rate"},
        Fault{"colour", "light colour"},
        Fault{"noise-reduction=0.4", "light noise-reduction"},
        Fault{"sharpening=0.4", "light sharpening"},
        Fault{"dark-subtraction", "sensor black-clipped"},
        Fault{"high-bits", "sensor missing-bits"},
        Fault{"black-clamp", "mirrors black-clamp"},
        Fault{"binning", "optics binning"}));

INSTANTIATE_TEST_SUITE_P (Lamp, WithoutFeatures,
    testing::Values (Fault{"pulsed=500:0.5", "pulsed"},
        Fault{"pulsed=3000:0.3", "pulsed"},
        Fault{"pulsed=25000:0.5", "light pulsed"},
        Fault{"flicker=24.9:0.3", "light flicker"},
        Fault{"flicker=1:0.3", "flicker"},
        Fault{"bright=8", "trigger bright"}));

INSTANTIATE_TEST_SUITE_P (Target, WithoutFeatures,
    testing::Values (Fault{"level=0.6 moving=5", "light moving"},
        Fault{"level=0.6 moving=0.3", "light moving"},
        Fault{"level=0.6 texture=0.04", "light texture"}));

INSTANTIATE_TEST_SUITE_P (Groups, WithoutFeatures,
    testing::Values (Fault{"dead-rows=2", "sensor dead-pixels"},
        Fault{"dead-blocks=2", "sensor dead-pixels"},
        Fault{"stuck-rows=2", "mirrors stuck-off"},
        Fault{"stuck-blocks=2", "mirrors stuck-off"}));

TEST (WithoutFeatures, NothingIsSaidOfAGoodCamera)
{
  for (int seed = 1; seed <= bench_count (4); seed++)
    EXPECT_EQ (examined (sick_bench (seed, "mute")), "") << seed;
}

TEST (Bend, IsNamedByItsForm)
{
  std::vector<ResponsePoint> power, bow, table;
  for (int i = 1; i <= 10; i++) {
    const double x = 0.1 * i;
    power.push_back ({x, std::pow (x + 0.02, 0.6) - std::pow (0.02, 0.6)});
    bow.push_back ({x, x - 0.2 * x * (1.0 - x)});
    table.push_back ({x, x - 0.08 * std::sin (2.0 * M_PI * x)});
  }
  EXPECT_STREQ (bend_of (power).id, "gamma");
  EXPECT_NEAR (bend_of (power).gamma, 0.6, 0.01);
  EXPECT_STREQ (bend_of (bow).id, "nonlinear");
  EXPECT_STREQ (bend_of (table).id, "lut");
}

/* Rows that see light later have it in later tiles. */
TEST (Rows, DelayIsThatOfTheirLight)
{
  constexpr double kPeriod = 0.04, kDelay = 0.006;
  std::map<double, std::vector<BorderLight>> tiles;
  for (int i = 0; i < 8; i++) {
    const auto light = [i] (double late) {
      return 100.0 +
             50.0 * std::cos (2 * M_PI * (i / 8.0 - 0.3 - late / kPeriod));
    };
    tiles[i * kPeriod / 8] = {{light (0.0), 0.7 * light (0.75 * kDelay)},
        {light (0.0), 0.7 * light (0.75 * kDelay)}};
  }
  const auto delay = row_delay (tiles, kPeriod);
  ASSERT_TRUE (delay);
  EXPECT_NEAR (delay->value, kDelay, 1e-9);
  tiles.begin ()->second.clear ();
  EXPECT_FALSE (row_delay (tiles, kPeriod));
}

TEST (Change, IsOneWhereOnlyNoiseDiffers)
{
  const auto stack = [] (std::uint64_t seed, double moving) {
    SickBenchOptions options = healthy_bench (3);
    options.seed = 5;
    options.level = 0.5;
    options.texture = 0.05;
    options.moving = moving;
    auto rig = SimulatedRig::make (options);
    EXPECT_TRUE (rig);
    Examination examination{**rig};
    std::vector<Stack> stacks;
    for (std::uint64_t i = 0; i < seed; i++)
      stacks.push_back (*look_at_light (examination, lit (0, 1), 1, 8));
    return stacks;
  };
  const Image<float> dark (256, 192);
  const auto still = stack (2, 0.0), moved = stack (2, 1.0);
  const auto change = [&dark] (const std::vector<Stack> &stacks) {
    const auto mean = [&stacks] (std::size_t i) {
      return FrameMean{stacks[i].mean.view (), stacks[i].frames};
    };
    return change_between (mean (0), mean (1), stacks[1], dark).value;
  };
  EXPECT_NEAR (change (still), 1.0, 0.2);
  EXPECT_GT (change (moved), 5.0);
}

/* Sums over frames are as good as a second look at each of them. */
TEST (StackSum, MeansAndNoiseAreThoseOfTheFrames)
{
  constexpr int kFrames = 9, kLargest = 4095;
  std::mt19937 random (7);
  std::normal_distribution<double> noise (0.0, 3.0);
  Image<float> dark (8, 6), light (8, 6);
  each_pixel (light, [&] (int x, int y) {
    dark.at (x, y) = float (20 + x);
    light.at (x, y) = float (1000 + 100 * x - 60 * y);
  });
  StackSum sum (kLargest);
  std::vector<SeenFrame> frames (kFrames);
  for (int i = 0; i < kFrames; i++) {
    SeenFrame &frame = frames[std::size_t (i)];
    frame.time = Nanoseconds (1000) + i * Nanoseconds (40);
    frame.picture = Image<std::uint16_t> (8, 6);
    const double level = 1.0 + 0.1 * std::sin (i);
    each_pixel (light, [&] (int x, int y) {
      const double value = double (dark.at (x, y)) +
                           level * double (light.at (x, y)) + noise (random);
      frame.picture.at (x, y) = std::uint16_t (std::lround (value));
    });
    frame.picture.at (3, 2) = 0;
    frame.picture.at (4, 2) = i < 4 ? kLargest : 100;
    sum.add (frame);
  }
  const auto made = std::move (sum).stack (&dark);
  ASSERT_TRUE (made);
  EXPECT_EQ (made->frames, kFrames);
  EXPECT_EQ (made->time, 1000 + 4 * 40);
  EXPECT_EQ (made->zeros.at (3, 2), kFrames);
  EXPECT_EQ (made->full.at (4, 2), 4);
  EXPECT_EQ (made->full.at (5, 2), 0);

  std::vector<double> levels;
  for (const SeenFrame &frame : frames)
    levels.push_back (mean_of (frame.picture.view ()));
  double middle = 0.0;
  for (const double level : levels)
    middle += level / kFrames;
  const double whole =
      mean_of (std::as_const (made->mean).view ()) - mean_of (dark.view ());
  each_pixel (light, [&] (int x, int y) {
    double mean = 0.0, squares = 0.0;
    for (const SeenFrame &frame : frames)
      mean += double (frame.picture.at (x, y)) / kFrames;
    const double part = (mean - double (dark.at (x, y))) / whole;
    for (std::size_t i = 0; i < frames.size (); i++)
      squares += std::pow (double (frames[i].picture.at (x, y)) - mean -
                               part * (levels[i] - middle),
          2);
    EXPECT_NEAR (made->mean.at (x, y), mean, 1e-3);
    EXPECT_NEAR (made->variance.at (x, y), squares / (kFrames - 1),
        1e-3 * (1.0 + squares / (kFrames - 1)));
  });
  const Image<float> other (4, 4);
  StackSum wrong (kLargest);
  wrong.add (frames[0]);
  EXPECT_FALSE (std::move (wrong).stack (&other));
}

} // namespace

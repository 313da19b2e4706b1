/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The simulated bench: exact pixel values of coded frames. */
#include "bench/bench.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "bench/light_share.h"
#include "exposed.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

/* Sum over the slots in which a pixel is open, in integers. */
template <typename Pixel>
void
expect_exact (const Schedule &schedule)
{
  SCOPED_TRACE (schedule.text ());
  const int width = 37, height = 23, slots = schedule.slots ();
  OpticalBench ideal = bench (width, height);
  const Image<Pixel> coded = coded_frame<Pixel> (ideal, schedule, width, height,
      [&] (int slot) { return scene<Pixel> (width, height, slot); });

  const int budget = schedule.max_on_slots ();
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      std::int64_t light = 0;
      for (int slot = 0; slot < slots; slot++)
        if (schedule.on (x, y, slot))
          light += scene<Pixel> (width, height, slot).at (x, y);
      ASSERT_EQ (coded.at (x, y), (2 * light + budget) / (2 * budget))
          << "at " << x << ", " << y;
    }
}

class Exact : public ::testing::TestWithParam<const char *>
{
};

TEST_P (Exact, CodedFrameIsTheMeanOfTheOpenSlots)
{
  expect_exact<std::uint8_t> (schedule (GetParam ()));
  expect_exact<std::uint16_t> (schedule (GetParam ()));
}

INSTANTIATE_TEST_SUITE_P (Schedules, Exact,
    ::testing::Values ("sequential:2x2", "sequential:lattice:4/2",
        "sequential:lattice:8/3,order=bit-reversal", "sequential:4x2,phase=1/3",
        "sequential:3x3", "staircase:2x2", "staircase:3x2",
        "staircase:lattice:8/3", "staircase:3x3", "s-matrix:lattice:7/2",
        "sequential:16x16",
        "staircase:2x2,region=12x8+6+5:sequential:3x2,region=4x4+20+1:"
        "staircase:2x1"));

TEST (Bench, ReadsRowsThatLieApart)
{
  const int width = 5, height = 4, stride = 11;
  const Schedule code = schedule ("sequential:2x2");
  Image<std::uint8_t> packed = scene<std::uint8_t> (width, height, 0);
  std::vector<std::uint8_t> in (stride * height, 99), out (stride * height, 77);
  for (int y = 0; y < height; y++)
    std::copy_n (packed.view ().row (y), width, in.data () + y * stride);

  OpticalBench ideal = bench (width, height);
  ideal.begin (code);
  for (int slot = 0; slot < 4; slot++)
    ideal.expose (
        ImageView<const std::uint8_t>{in.data (), width, height, stride}, slot,
        1.0);
  ideal.read_out (
      0, ImageView<std::uint8_t>{out.data (), width, height, stride});
  for (int y = 0; y < height; y++)
    for (int x = 0; x < stride; x++)
      EXPECT_EQ (
          out[std::size_t (y * stride + x)], x < width ? packed.at (x, y) : 77);
}

TEST (Bench, WhiteIsWhiteWithLeakAndEveryCode)
{
  for (const char *preset : {"sequential:2x2,leak=0.05", "sequential:3x3",
           "staircase:2x2,leak=0.1", "s-matrix:lattice:7/2,leak=0.02"}) {
    SCOPED_TRACE (preset);
    const Schedule code = schedule (preset);
    OpticalBench ideal = bench (18, 14);
    const Image<std::uint8_t> coded =
        still (ideal, code, flat<std::uint8_t> (18, 14, 255));
    const int most = code.code ().max_on_slots ();
    for (int y = 0; y < 14; y++)
      for (int x = 0; x < 18; x++)
        if (code.code ().on_slots (code.element_at (x, y)) == most) {
          ASSERT_EQ (coded.at (x, y), 255);
        }
  }
}

TEST (Bench, ShutMirrorsLeakWhatTheScheduleSays)
{
  const Schedule code = schedule ("sequential:2x2,leak=0.25");
  OpticalBench ideal = bench (2, 2);
  ideal.begin (code);
  ideal.expose (flat<std::uint8_t> (2, 2, 140).view (), 0, 1.0);
  Image<std::uint8_t> coded (2, 2);
  ideal.read_out (0, coded.view ());
  /* White needs 1 + 3 * 0.25 = 1.75 slots. */
  EXPECT_DOUBLE_EQ (ideal.gain (), 4 / 1.75);
  EXPECT_EQ (coded.at (0, 0), 80);
  EXPECT_EQ (coded.at (1, 0), 20);
  EXPECT_EQ (coded.at (0, 1), 20);
  EXPECT_EQ (coded.at (1, 1), 20);
}

TEST (Bench, ParkedMirrorsAreDarkButForTheirLeak)
{
  Image<std::uint8_t> coded (4, 4);
  for (const auto &[preset, expected] : {std::pair ("sequential:2x2", 0),
           std::pair ("sequential:2x2,leak=0.25", 114)}) {
    OpticalBench ideal = bench (4, 4);
    ideal.begin (schedule (preset));
    for (int slot = 0; slot < 4; slot++)
      ideal.expose (flat<std::uint8_t> (4, 4, 200).view (), -1, 1.0);
    ideal.read_out (0, coded.view ());
    EXPECT_EQ (coded, (flat<std::uint8_t> (4, 4, std::uint8_t (expected))));
  }
}

TEST (Bench, NothingExposedIsBlack)
{
  OpticalBench ideal = bench (4, 4);
  const Schedule code;
  Image<std::uint8_t> coded = flat<std::uint8_t> (4, 4, 9);
  still (ideal, code, flat<std::uint8_t> (4, 4, 200));
  ideal.begin (code);
  ideal.read_out (0, coded.view ());
  EXPECT_EQ (coded, (flat<std::uint8_t> (4, 4, 0)));
}

TEST (Bench, GainAndBitsScaleTheNumbers)
{
  const Schedule code = schedule ("staircase:2x2");
  BenchOptions options;
  options.bits = 12;
  OpticalBench twelve = bench (2, 2, options);
  const auto white = [] (int) { return flat<std::uint16_t> (2, 2, 65535); };
  Image<std::uint16_t> coded =
      coded_frame<std::uint16_t> (twelve, code, 2, 2, white);
  /* Elements 0..3 are open in 1..4 slots of 4. */
  EXPECT_EQ (coded.at (0, 0), 1024);
  EXPECT_EQ (coded.at (1, 1), 4095);

  options.gain = 2.0;
  OpticalBench bright = bench (2, 2, options);
  coded = coded_frame<std::uint16_t> (bright, code, 2, 2, white);
  EXPECT_EQ (coded.at (0, 0), 2048);
  EXPECT_EQ (coded.at (1, 0), 4095);
  EXPECT_EQ (coded.at (1, 1), 4095) << "clamped";
  EXPECT_DOUBLE_EQ (bright.gain (), 2.0);
}

TEST (Bench, SaysWhichOptionIsWrong)
{
  const auto error = [] (BenchOptions options) {
    Result<OpticalBench> made = OpticalBench::make (4, 4, options);
    return made ? "" : made.error ().message;
  };
  BenchOptions options;
  options.psf_sigma = 17;
  EXPECT_EQ (error (options), "PSF sigma (pixels) = 17 is outside 0..16");
  options = {};
  options.alignment.scale = 0;
  EXPECT_EQ (error (options), "scale (pixels a mirror) = 0 is outside 0.5..4");
  options = {};
  options.gain = std::nan ("");
  EXPECT_EQ (error (options), "gain = nan is outside 0..1000");
  options = {};
  options.read_noise = 5;
  EXPECT_EQ (error (options),
      "read noise is counted in electrons and needs a full well; set it, 10000 "
      "for example");
  EXPECT_FALSE (OpticalBench::make (0, 4, {}));
}

SlotPlan
plan (const Timing &timing, int slots, FrameRate rate)
{
  return SlotPlan::fit (timing, slots, rate).value ();
}

constexpr Nanoseconds kMillisecond = 1'000'000;

TEST (LightShare, OneStretchASlotGivesAllOfIt)
{
  for (const FrameRate rate : {FrameRate{25, 1}, FrameRate{30000, 1001}})
    for (const int slots : {4, 8, 9, 256}) {
      const auto shares = share_light (plan ({}, slots, rate), slots);
      ASSERT_EQ (int (shares.size ()), slots);
      for (int i = 0; i < slots; i++)
        EXPECT_EQ (shares[std::size_t (i)], (std::vector<LightShare>{{i, 1.0}}))
            << slots << " slots at " << rate.num << "/" << rate.den;
    }
}

TEST (LightShare, SwitchingIsDarkAndTakesNothingFromTheRest)
{
  const Timing paper = {9'800'000, 200'000, 0};
  const auto shares = share_light (plan (paper, 4, {25, 1}), 8);
  for (int i = 0; i < 8; i += 2) {
    ASSERT_EQ (shares[std::size_t (i)].size (), 1u);
    ASSERT_EQ (shares[std::size_t (i) + 1].size (), 1u);
    EXPECT_EQ (shares[std::size_t (i)][0].slot, i / 2);
    EXPECT_NEAR (shares[std::size_t (i)][0].slots, 5.0 / 9.8, 1e-6);
    EXPECT_EQ (
        shares[std::size_t (i)][0].slots + shares[std::size_t (i) + 1][0].slots,
        1.0);
  }
}

TEST (LightShare, ReadoutTakesItsPartOfTheStretches)
{
  const Timing timing = {0, 0, 10 * kMillisecond};
  const auto shares = share_light (plan (timing, 4, {25, 1}), 4);
  /* Slots of 7.5 ms, stretches of 10 ms. */
  EXPECT_EQ (shares[0].size (), 2u);
  EXPECT_EQ (shares[0][0], (LightShare{0, 1.0}));
  EXPECT_EQ (shares[0][1].slot, 1);
  EXPECT_NEAR (shares[0][1].slots, 1.0 / 3, 1e-6);
  EXPECT_NEAR (shares[1][0].slots, 2.0 / 3, 1e-6);
  EXPECT_NEAR (shares[1][1].slots, 2.0 / 3, 1e-6);
  EXPECT_TRUE (shares[3].empty ());
}

TEST (LightShare, HalvesAreHalvesAtEveryRate)
{
  for (const FrameRate rate : {FrameRate{25, 1}, FrameRate{30000, 1001}}) {
    const auto shares = share_light (plan ({}, 4, rate), 8);
    for (int i = 0; i < 8; i++)
      EXPECT_EQ (
          shares[std::size_t (i)], (std::vector<LightShare>{{i / 2, 0.5}}));
  }
}

TEST (LightShare, EverySlotGetsAllItsLight)
{
  const Timing timing = {0, 123'457, 3'333'333};
  for (const int slots : {4, 9, 25})
    for (const int multiple : {1, 2, 3, 7}) {
      std::vector<double> sums (std::size_t (slots), 0.0);
      for (const auto &stretch :
          share_light (plan (timing, slots, {30000, 1001}), slots * multiple))
        for (const LightShare &share : stretch)
          sums[std::size_t (share.slot)] += share.slots;
      for (const double sum : sums)
        EXPECT_EQ (sum, 1.0);
    }
}

TEST (Bench, BlurMixesTheCodesOfNeighbours)
{
  BenchOptions options;
  options.psf_sigma = 0.5;
  OpticalBench blurred = bench (16, 16, options);
  /* Light in slot 0 only reaches element 0's pixels, and now its neighbours. */
  const Image<std::uint8_t> coded = coded_frame<std::uint8_t> (
      blurred, schedule ("sequential:2x2"), 16, 16, [] (int slot) {
        return flat<std::uint8_t> (16, 16, slot == 0 ? 200 : 0);
      });
  EXPECT_LT (coded.at (6, 6), 150);
  EXPECT_GT (coded.at (7, 6), 30);
  EXPECT_GT (coded.at (7, 7), 10);
  const int sum =
      coded.at (6, 6) + coded.at (7, 6) + coded.at (6, 7) + coded.at (7, 7);
  EXPECT_NEAR (sum, 200, 2) << "no light is lost";
}

/* ------------------------------------------------------- bench profile -- */

TEST (Black, IsAddedAndLeavesWhiteWhite)
{
  const int black = 15;
  OpticalBench raised = bench (8, 4, {.black_level = black});
  for (const int value : {0, 17, 128, 255}) {
    const auto coded = still (raised, schedule ("sequential:2x2"),
        flat<std::uint8_t> (8, 4, std::uint8_t (value)));
    EXPECT_EQ (
        coded.at (3, 1), int (value * (255.0 - black) / 255.0 + black + 0.5));
  }
}

TEST (Mapping, SimulatesLikeItsAlignment)
{
  const int width = 64, height = 48;
  const Schedule masks = schedule ("sequential:2x2");
  for (const Alignment alignment : {Alignment{.shift_x = 1.0},
           Alignment{.shift_x = 0.3, .rotation = 0.5, .scale = 1.02}}) {
    BenchOptions aligned{.psf_sigma = 0.9, .alignment = alignment};
    BenchOptions mapped{.psf_sigma = 0.9};
    const Homography h = camera_to_mirrors (alignment, width, height);
    mapped.mapping = *Mapping::make ({{width, height}, {width, height}, h});
    /* The same place in a larger array, by whole tiles. */
    BenchOptions larger = mapped;
    Homography inside = h;
    inside[2] += 8.0;
    inside[5] += 4.0;
    larger.mapping =
        *Mapping::make ({{width, height}, {width + 16, height + 8}, inside});

    OpticalBench first = bench (width, height, aligned);
    const auto expected =
        still (first, masks, scene<std::uint8_t> (width, height, 1));
    for (const BenchOptions &options : {mapped, larger}) {
      OpticalBench second = bench (width, height, options);
      const auto coded =
          still (second, masks, scene<std::uint8_t> (width, height, 1));
      for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
          ASSERT_NEAR (coded.at (x, y), expected.at (x, y), 1)
              << x << ", " << y;
    }
  }
  EXPECT_FALSE (OpticalBench::make (
      width, height, {.mapping = Mapping (Extent{32, 24})}));
}

/* A full well at which the camera has a number below the largest is where
 * white is, and more light does not make more. */
TEST (Profile, TheWellEndsTheRange)
{
  BenchProfile profile;
  profile.camera.size = {8, 4};
  profile.conversion_gain = Measured{100.0, 1.0};
  profile.full_well = Measured{20000.0, 10.0};
  const Schedule masks = schedule ("sequential:2x2");
  const BenchOptions options =
      BenchOptions{.full_well = BenchOptions::kUnset}.completed (
          &profile, masks);
  EXPECT_DOUBLE_EQ (options.full_well, 80000.0);
  EXPECT_DOUBLE_EQ (options.gain, 80000.0 / (100.0 * 255.0));
  EXPECT_EQ (options.psf_sigma, 0.0);
  OpticalBench limited = bench (8, 4, options);
  EXPECT_NEAR (
      still (limited, masks, flat<std::uint8_t> (8, 4, 255)).at (0, 0), 200, 4);
}

} // namespace

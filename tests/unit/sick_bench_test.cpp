/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The bench with faults: each number that is injected is in its frames. */
#include <chrono>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "bench/simulated_rig.h"

using namespace codedexposure;

namespace
{

constexpr Nanoseconds kMs = 1'000'000;

StillMask
light_in (int first, int slots)
{
  return {.name = "light",
      .on = [] (int, int) { return true; },
      .slots = slots,
      .first = first};
}

/** A bench with the faults @p words, whose pixels are all alike. */
std::unique_ptr<SimulatedRig>
rig_with (const std::string &words, int bits = 8)
{
  SickBenchOptions options;
  options.bits = bits;
  options.prnu = 0.0;
  options.jitter = 0.0;
  const auto inflicted = inflict (options, words);
  EXPECT_TRUE (inflicted.ok ()) << inflicted.error ().message;
  auto rig = SimulatedRig::make (options);
  EXPECT_TRUE (rig.ok ()) << rig.error ().message;
  return rig ? *std::move (rig) : nullptr;
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

/** Frames of a mask, without the two of the mask before. */
std::vector<SeenFrame>
frames_of (Rig &rig, const StillMask &mask, int slots, int frames)
{
  const auto shown = rig.show (mask, slots);
  EXPECT_TRUE (shown.ok ()) << shown.error ().message;
  auto seen = rig.watch (frames + 2);
  if (!seen || seen->size () < 2)
    return {};
  return {seen->end () - frames, seen->end ()};
}

double
level_of (Rig &rig, const StillMask &mask, int slots, int frames = 4)
{
  double sum = 0.0;
  const auto seen = frames_of (rig, mask, slots, frames);
  for (const SeenFrame &frame : seen)
    sum += mean_of (frame.picture) / double (seen.size ());
  return sum;
}

/** Light of each of the slots in one exposure, above black, as part of all. */
std::vector<double>
profile_of (Rig &rig, int slots)
{
  constexpr double black = 4.0;
  const double all = level_of (rig, light_in (0, slots), slots) - black;
  std::vector<double> parts;
  for (int slot = 0; slot < slots; slot++)
    parts.push_back ((level_of (rig, light_in (slot, 1), slots) - black) / all);
  return parts;
}

} // namespace

TEST (SickBench, ShowsTheLightOfItsLevel)
{
  const auto rig = rig_with ("level=0.7 black=10 leak=0.01 noise=40");
  EXPECT_NEAR (level_of (*rig, light_in (0, 4), 4), 10 + 0.7 * (255 - 10), 0.2);
  EXPECT_NEAR (level_of (*rig, light_in (1, 2), 4),
      10 + 0.7 * 245 * (0.01 + 0.99 * 20.0 / 39.9), 0.3);
  const double off = level_of (
      *rig, {.name = "off", .on = [] (int, int) { return false; }}, 1);
  EXPECT_NEAR (off, 10 + 0.7 * 245 * 0.01, 0.1);
}

TEST (SickBench, APictureDoesNotDependOnWhereItsMasksAreInMemory)
{
  SickBenchOptions options;
  options.bits = 16;
  options.full_well = 1e9; // so that the last bits of sums show
  using Mask = std::shared_ptr<Image<std::uint8_t>>;
  const auto picture_of = [&options] (const Mask &first, const Mask &second) {
    for (int y = 0; y < options.mirrors.height; y++)
      for (int x = 0; x < options.mirrors.width; x++) {
        first->at (x, y) = x % 2 == 0;
        second->at (x, y) = y % 3 == 0;
      }
    auto bench = SickBench::make (options);
    EXPECT_TRUE (bench.ok ());
    bench->show (
        0, {.period = 40 * kMs,
               .masks = {first, second},
               .stretches = {{0, 15 * kMs, 0}, {15 * kMs, 39 * kMs, 1}},
               .slot = 20 * kMs});
    Image<std::uint16_t> picture (options.camera.width, options.camera.height);
    const auto shot = bench->next (1000 * kMs);
    EXPECT_TRUE (shot.has_value ());
    bench->take (shot.value_or (Shot{}), picture.view ());
    return picture;
  };
  const auto a = std::make_shared<Image<std::uint8_t>> (
      options.mirrors.width, options.mirrors.height);
  const auto b = std::make_shared<Image<std::uint8_t>> (*a);
  EXPECT_TRUE (picture_of (a, b) == picture_of (b, a));
}

TEST (SickBench, TheExposureIsWhereTheTruthHasIt)
{
  for (const char *words : {"delay=100us", "exposure-late=3ms",
           "exposure-short=6ms", "trigger-edge=20ms"}) {
    const auto rig = rig_with (std::string ("leak=0 ") + words);
    const BenchProfile &truth = rig->truth ().profile;
    const double begin = truth.trigger_delay->value;
    const double end = begin + truth.exposure->value;
    const double slot = 2.5e6, period = 40e6;
    const auto parts = profile_of (*rig, 16);
    for (int s = 0; s < 16; s++) {
      double light = 0.0;
      for (int cycle = 0; cycle < 2; cycle++) {
        const double from = cycle * period + s * slot;
        light += std::max (
            0.0, std::min (from + slot, end) - std::max (from, begin));
      }
      EXPECT_NEAR (parts[std::size_t (s)], light / (end - begin), 0.002)
          << words << ", slot " << s;
    }
  }
}

TEST (SickBench, FlickerHasItsFrequencyAndDepth)
{
  const auto rig = rig_with ("flicker=101:0.2 leak=0 level=0.9 delay=0s "
                             "readout=0s full-well=1000000",
      12);
  /* 25 frames/s see 101 Hz as 1 Hz; in 1/40 of a period, it is almost still. */
  constexpr int kFrames = 25;
  double sum = 0.0, in_phase = 0.0, across = 0.0;
  const auto frames = frames_of (*rig, light_in (20, 1), 40, kFrames);
  ASSERT_EQ (frames.size (), std::size_t (kFrames));
  for (std::size_t k = 0; k < frames.size (); k++) {
    const double level = mean_of (frames[k].picture) - 4.0;
    const double angle = 2.0 * std::numbers::pi * double (k) / kFrames;
    sum += level;
    in_phase += 2 * level * std::cos (angle);
    across += 2 * level * std::sin (angle);
  }
  const double turn = 0.101 * std::numbers::pi;
  EXPECT_NEAR (
      std::hypot (in_phase, across) / sum, 0.2 * std::sin (turn) / turn, 0.001);
}

TEST (SickBench, AFrameThatIsLateCarriesTheMaskBefore)
{
  for (const int late : {0, 1, 3}) {
    const auto rig = rig_with ("frame-late=" + std::to_string (late));
    ASSERT_TRUE (rig->show (light_in (0, 1), 4).ok ());
    ASSERT_EQ (rig->watch (8)->size (), 8u);
    ASSERT_TRUE (rig->show (light_in (0, 4), 4).ok ());
    const auto seen = rig->watch (12);
    ASSERT_EQ (seen->size (), 12u);
    /* Two are on their way, the later one cut short. */
    for (std::size_t k = 2; k < 12; k++)
      EXPECT_EQ (mean_of ((*seen)[k].picture) > 150, k >= 2u + unsigned (late))
          << k << " of " << late;
  }
}

TEST (SickBench, TheTriggerDecidesWhichFramesCome)
{
  const auto spacing = [] (const std::string &words) {
    const auto rig = rig_with (words);
    const auto frames = frames_of (*rig, light_in (0, 4), 4, 10);
    return frames.size () < 10
               ? 0.0
               : double (frames.back ().time - frames.front ().time) / 9e6;
  };
  EXPECT_NEAR (spacing (""), 40.0, 0.01);
  EXPECT_NEAR (spacing ("half-rate"), 80.0, 0.02);
  EXPECT_NEAR (spacing ("double-rate"), 20.0, 0.01);
  EXPECT_NEAR (spacing ("free-running=24"), 1000.0 / 24, 0.01);
  EXPECT_EQ (spacing ("no-trigger"), 0.0);

  const auto parked = rig_with ("");
  ASSERT_TRUE (parked->show (light_in (0, 1), 4).ok ());
  parked->park ();
  EXPECT_EQ (parked->watch (10)->size (), 2u) << "those on their way";
  const auto before = parked->now ();
  EXPECT_TRUE (parked->watch (10)->empty ());
  EXPECT_EQ (parked->now () - before, 2000 * kMs);
  EXPECT_TRUE (parked->watch_until (parked->now () + 600 * kMs, 10)->empty ());
  EXPECT_EQ (parked->now () - before, 2600 * kMs);
}

TEST (SickBench, MasksThatCannotBeCompressedTakeLongToReceive)
{
  const auto rig = rig_with ("");
  const auto seconds_to_show = [&rig] (std::function<bool (int, int)> on) {
    const auto before = rig->now ();
    EXPECT_TRUE (rig->show ({.name = "mask", .on = std::move (on)}, 1).ok ());
    return 1e-9 * double (rig->now () - before);
  };
  EXPECT_LT (seconds_to_show ([] (int, int) { return true; }), 0.3);
  EXPECT_LT (seconds_to_show ([] (int x, int) { return x % 3 == 0; }), 0.3);
  /* 24 bits of each mirror, at 64 kB/s. */
  const Extent mirrors = rig->parts ().dmd.size;
  EXPECT_NEAR (seconds_to_show ([] (int x, int y) { return (x + y) % 2 == 0; }),
      3.0 * mirrors.width * mirrors.height / 64e3, 0.3);
}

TEST (SickBench, ThePhotonsHaveTheirNoise)
{
  const auto rig = rig_with ("full-well=8000 noise=6 level=0.6");
  const auto frames = frames_of (*rig, light_in (0, 4), 4, 2);
  ASSERT_EQ (frames.size (), 2u);
  double variance = 0.0;
  for (int y = 0; y < 192; y++)
    for (int x = 0; x < 256; x++)
      variance += std::pow (
          double (frames[0].picture.at (x, y)) - frames[1].picture.at (x, y),
          2);
  variance /= 2.0 * 256 * 192;
  const double gain = rig->truth ().profile.conversion_gain->value;
  EXPECT_NEAR (gain, 8000.0 / 251, 1e-9);
  const double expected =
      (0.6 * 8000 + 36) / (gain * gain) + 1.0 / 12; // and rounding
  EXPECT_NEAR (variance / expected, 1.0, 0.03);
}

TEST (SickBench, PatternsLieWhereTheMappingSays)
{
  for (const char *words : {"shift=1.5/-2 rotation=0.5 scale=0.99",
           "turned=90 shift=3/1", "flipped-x", "flipped-y rotation=2",
           "distortion=0.01 perspective=0.02/-0.01", "turned=270 scale=1.1",
           "turned=180 distortion=-0.01"}) {
    const auto rig = rig_with (std::string ("blur=0.3 leak=0 ") + words);
    const Mapping &mapping = *rig->truth ().profile.mapping;
    /* Blocks of 10 x 10 mirrors. */
    const StillMask blocks{.name = "blocks",
        .on = [] (int x, int y) { return (x / 10 + y / 10) % 2 == 0; },
        .slots = 4};
    const auto frames = frames_of (*rig, blocks, 4, 1);
    ASSERT_EQ (frames.size (), 1u);
    int right = 0, all = 0;
    for (int y = 4; y < 188; y++)
      for (int x = 4; x < 252; x++) {
        const Position at = mapping.mirror_at (x, y);
        const double u = std::fmod (at.x + 0.5, 10),
                     v = std::fmod (at.y + 0.5, 10);
        const bool inside = u > 2 && u < 8 && v > 2 && v < 8 && at.x > 0 &&
                            at.y > 0 && at.x < 287 && at.y < 223;
        if (!inside)
          continue;
        all++;
        right += (frames[0].picture.at (x, y) > 100) ==
                 blocks.on (int (at.x + 0.5), int (at.y + 0.5));
      }
    EXPECT_GT (all, 8000) << words;
    EXPECT_EQ (right, all) << words;
  }
}

TEST (SickBench, AMaskOfAllMirrorsIsTheSameFromEitherWay)
{
  /* One mirror at the corner of the array, far from the camera, makes it a
   * picture. */
  const StillMask most{.name = "most",
      .on = [] (int x, int y) { return x + y > 0; },
      .slots = 2};
  const auto a = rig_with ("stuck-off=9 vignetting=0.3 dust=3 noise=0");
  const auto b = rig_with ("stuck-off=9 vignetting=0.3 dust=3 noise=0");
  const auto all = frames_of (*a, light_in (0, 2), 4, 1);
  const auto picture = frames_of (*b, most, 4, 1);
  ASSERT_EQ (all.size () + picture.size (), 2u);
  int different = 0;
  for (int y = 0; y < 192; y++)
    for (int x = 0; x < 256; x++)
      different += std::abs (int (all[0].picture.at (x, y)) -
                             int (picture[0].picture.at (x, y))) > 1;
  EXPECT_EQ (different, 0);
}

TEST (SickBench, PixelsHaveTheirDefects)
{
  const auto rig = rig_with ("hot-pixels=30 dead-pixels=20 missing-bits=2 "
                             "black=8");
  const auto dark = frames_of (
      *rig, {.name = "off", .on = [] (int, int) { return false; }}, 1, 1);
  const auto bright = frames_of (*rig, light_in (0, 4), 4, 1);
  ASSERT_EQ (dark.size () + bright.size (), 2u);
  EXPECT_EQ (rig->truth ().hot.size (), 30u);
  for (const Offset hot : rig->truth ().hot)
    EXPECT_GT (dark[0].picture.at (hot.x, hot.y), 40);
  for (const Offset dead : rig->truth ().dead)
    EXPECT_LT (bright[0].picture.at (dead.x, dead.y), 12);
  for (int y = 0; y < 192; y++)
    for (int x = 0; x < 256; x++)
      ASSERT_EQ (bright[0].picture.at (x, y) % 4, 0);
}

TEST (SickBench, ANonlinearSensorBowsByItsPart)
{
  const auto rig = rig_with ("nonlinear=0.05 leak=0 level=0.5 noise=0");
  EXPECT_NEAR (
      level_of (*rig, light_in (0, 4), 4), 4 + 251 * (0.5 + 0.05), 0.3);
}

TEST (SickBench, ATiltOfTheFocusBlursOneSide)
{
  const auto rig = rig_with ("focus-tilt=4:0 blur=0.3 leak=0 noise=0");
  const StillMask lines{.name = "lines",
      .on = [] (int, int y) { return y / 4 % 2 == 0; },
      .slots = 4};
  const auto frames = frames_of (*rig, lines, 4, 1);
  ASSERT_EQ (frames.size (), 1u);
  const auto contrast = [&] (int x) {
    int low = 255, high = 0;
    for (int y = 60; y < 120; y++) {
      low = std::min<int> (low, frames[0].picture.at (x, y));
      high = std::max<int> (high, frames[0].picture.at (x, y));
    }
    return high - low;
  };
  EXPECT_GT (contrast (10), 180);
  EXPECT_LT (contrast (245), 40);
}

TEST (SickBench, AnExposureTimeHoldsFromALaterFrameOn)
{
  const auto rig = rig_with ("leak=0");
  ASSERT_TRUE (rig->show (light_in (0, 4), 4).ok ());
  ASSERT_EQ (rig->watch (4)->size (), 4u);
  ASSERT_TRUE (rig->expose (10 * kMs).ok ());
  const auto seen = rig->watch (6);
  EXPECT_GT (mean_of ((*seen)[0].picture), 180);
  EXPECT_NEAR (mean_of ((*seen)[5].picture), 4 + 0.8 * 251 * 10 / 39.9, 0.5);
  EXPECT_FALSE (rig->expose (1).ok ());
}

TEST (SickBench, RecordsAScheduleWithItsLossesAndSlips)
{
  const auto schedule = Schedule::parse ("sequential:2x2,pilot=8");
  const auto rig = rig_with ("lose=0.1 slip=1s");
  std::uint64_t frames = 0, lost = 0;
  bool slipped = false;
  ASSERT_TRUE (rig->record (*schedule, 4.0,
                      [&] (const RecordedFrame &frame) {
                        frames++;
                        lost += frame.lost_before;
                        slipped |= frame.synchronised == false;
                      })
                   .ok ());
  EXPECT_NEAR (double (frames + lost), 100, 2);
  EXPECT_GT (lost, 0u);
  EXPECT_TRUE (slipped);
}

TEST (SickBench, WordsAreCheckedAndAllOrNothing)
{
  SickBenchOptions options;
  const auto message = [&options] (const char *words) {
    const auto done = inflict (options, words);
    return done ? std::string () : done.error ().message;
  };
  EXPECT_EQ (message ("leak=0.1 flicer=100:0.1"),
      "fault 'flicer=100:0.1' has no known name; \"--faults help\" lists the "
      "names");
  EXPECT_EQ (options.leak, SickBenchOptions{}.leak);
  EXPECT_EQ (message ("flicker=100"),
      "fault 'flicker=100' is not flicker=HZ:DEPTH within its limits; write "
      "for example flicker=100:0.1");
  EXPECT_EQ (message ("leak=0.1 blur=1 leak=0.2"),
      "fault 'leak' is there twice; leave one of them out");
  EXPECT_EQ (options.leak, SickBenchOptions{}.leak);
  EXPECT_NE (message ("leak=1.5"), "");
  EXPECT_NE (message ("hot-pixels=1.5"), "");
  EXPECT_NE (message ("no-trigger=1"), "");
  EXPECT_NE (message ("turned=45"), "");
  EXPECT_EQ (message ("low-bits pixel-format"),
      "the faults pixel-format, low-bits and high-bits all set the bits that "
      "are sent; leave only one of them");
  EXPECT_EQ (message ("flicker leak exposure-late=1.5ms dmd-busy"), "");
  EXPECT_EQ (options.flicker_depth, 0.1);
  EXPECT_EQ (options.late, 1'500'000);
  EXPECT_TRUE (options.has ("dmd-busy"));
  EXPECT_EQ (SimulatedRig::make (options).error ().code, ErrorCode::busy);
  EXPECT_NE (fault_help ().find ("flicker[=HZ:DEPTH]"), std::string::npos);
}

TEST (SickBench, RandomBenchesAreMade)
{
  SickBenchOptions drawn;
  ASSERT_TRUE (inflict (drawn, "healthy=7 leak=0.1").ok ());
  EXPECT_EQ (drawn.full_well, random_healthy_bench (7).full_well);
  EXPECT_EQ (drawn.leak, 0.1);
  SickBenchOptions other;
  other.second = {second_camera_of (other)};
  ASSERT_TRUE (
      inflict (other, "leak=0.1 healthy=7 second:blur=2 second:healthy=8")
          .ok ());
  EXPECT_EQ (other.full_well, drawn.full_well);
  EXPECT_EQ (other.leak, 0.1);
  EXPECT_EQ (other.second.front ().blur, 2.0);
  EXPECT_EQ (other.second.front ().seed, 8u);
  for (std::uint64_t seed = 0; seed < 200; seed++) {
    SickBenchOptions like;
    like.bits = seed % 2 == 0 ? 8 : 12;
    const auto options = random_healthy_bench (seed, like);
    EXPECT_LE (options.delay, 300'000);
    if (seed % 20 == 0) {
      EXPECT_TRUE (SimulatedRig::make (options).ok ());
    }
  }
}

/* A frame of light in a part of the period, as most checks use. */
TEST (SickBench, IsFast)
{
  const auto rig = rig_with ("flicker=100:0.1 prnu=0.01");
  ASSERT_TRUE (rig->show (light_in (0, 4), 4).ok ());
  const auto began = std::chrono::steady_clock::now ();
  ASSERT_EQ (rig->watch (100)->size (), 100u);
  const std::chrono::duration<double, std::milli> took =
      std::chrono::steady_clock::now () - began;
  RecordProperty ("ms_per_frame", std::to_string (took.count () / 100));
  std::printf ("%.3f ms a frame\n", took.count () / 100);
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Fusion: accuracy, limits and errors. */
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "fuse_scenes.h"
#include "random_numbers.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

TEST (Fuse, AllTargetsGiveTheSamePixels)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto coded = take (schedule, 2, [] (int slot) {
    return draw (
        40, 32, [slot] (int x, int y) { return texture (x - slot, y); });
  });
  for (const FuseQuality quality : kQualities) {
    FuseOptions options = with_quality (quality);
    const auto expected = fuse (coded, schedule, options);
    for (const std::string_view target : fuse_targets ()) {
      options.target = target;
      EXPECT_EQ (fuse (coded, schedule, options), expected)
          << target << ' ' << quality_name (quality);
    }
  }
}

/* Enough rows for several bands of each kind; and a last band of one row, which
 * shares a block of 2x2 pixels with the one above. */
TEST (Fuse, AnyNumberOfThreadsGivesTheSamePixels)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  for (const int height : {160, 33, 49}) {
    const auto coded = take (schedule, 3, [height] (int slot) {
      return draw (
          24, height, [slot] (int x, int y) { return texture (x - slot, y); });
    });
    for (const FuseQuality quality : kQualities) {
      if (height < 160 && quality != FuseQuality::kFast)
        break;
      FuseOptions options = with_quality (quality, true);
      options.lookahead = 1;
      options.threads = 1;
      const auto expected = fuse (coded, schedule, options);
      for (const int threads : {2, 3, 7}) {
        options.threads = threads;
        EXPECT_EQ (fuse (coded, schedule, options), expected)
            << threads << ' ' << quality_name (quality) << ' ' << height;
      }
    }
  }
}

TEST (Fuse, StopsWhenItIsAskedToAndBeginsAnew)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  const auto coded = take (schedule, 1, [] (int slot) {
    return draw (
        24, 20, [slot] (int x, int y) { return texture (x - slot, y); });
  });
  for (const FuseQuality quality :
      {FuseQuality::kBalanced, FuseQuality::kBest, FuseQuality::kLearned}) {
    const FuseOptions options = with_quality (quality);
    auto fuser = Fuser<std::uint8_t>::make (schedule, 24, 20, options);
    ASSERT_TRUE (fuser);
    Pictures<> slots (4, Image<std::uint8_t> (24, 20));
    std::vector<ImageView<std::uint8_t>> views;
    for (auto &slot : slots)
      views.push_back (slot.view ());
    std::stop_source stop;
    stop.request_stop ();
    EXPECT_TRUE (fuser->take (coded[0].view ()));
    EXPECT_FALSE (fuser->fuse (views, stop.get_token ()));
    EXPECT_EQ (fuser->pending (), 0);
    fuser->forget ();
    EXPECT_TRUE (fuser->take (coded[0].view ()));
    EXPECT_TRUE (fuser->fuse (views));
    EXPECT_EQ (slots, fuse (coded, schedule, options));
  }
}

TEST (Fuse, FastStopsWithinAFrame)
{
  std::stop_source stop;
  stop.request_stop ();
  const auto unmade = Fuser<std::uint8_t>::make (
      schedule_of ("sequential:16x16"), 24, 20, {}, stop.get_token ());
  ASSERT_FALSE (unmade);
  EXPECT_EQ (unmade.error ().code, ErrorCode::cancelled);
  auto fuser =
      Fuser<std::uint8_t>::make (schedule_of ("sequential:2x2"), 24, 20);
  ASSERT_TRUE (fuser);
  const Image<std::uint8_t> coded (24, 20);
  Pictures<> slots (4, coded);
  std::vector<ImageView<std::uint8_t>> views;
  for (auto &slot : slots)
    views.push_back (slot.view ());
  EXPECT_TRUE (fuser->take (coded.view ()));
  const auto done = fuser->fuse (views, stop.get_token ());
  ASSERT_FALSE (done);
  EXPECT_EQ (done.error ().code, ErrorCode::cancelled);
  EXPECT_TRUE (fuser->take (coded.view ()));
  EXPECT_TRUE (fuser->fuse (views));
}

/* -------------------------------------------------------------- pixels -- */

constexpr const char *kSchedules[] = {"sequential:2x2", "sequential:4x2",
    "sequential:lattice:4/2", "sequential:lattice:8/3,order=bit-reversal",
    "sequential:diamond:5", "sequential:lattice:4/2,leak=0.02", "staircase:2x2",
    "staircase:lattice:4/2", "s-matrix:7x1"};

/* Of electrons, which hide everything. */
TEST (Fuse, FlatLightStaysFlatUnderAnyNoise)
{
  for (const auto &[preset, quality] :
      {std::pair ("sequential:lattice:4/2", FuseQuality::kFast),
          {"sequential:lattice:4/2", FuseQuality::kBalanced},
          {"sequential:4x4", FuseQuality::kFast}}) {
    const Schedule schedule = schedule_of (preset);
    const auto coded = take (schedule, 2,
        [] (int) { return draw (40, 35, [] (int, int) { return 0.4; }); });
    for (const SensorNoise &noise :
        {SensorNoise{1.0, 5.0}, SensorNoise{1000.0, 2000.0}}) {
      FuseOptions options = with_quality (quality);
      options.noise = noise;
      for (const auto &frame : fuse (coded, schedule, options))
        for (int y = 0; y < frame.height (); y++)
          for (int x = 0; x < frame.width (); x++)
            ASSERT_NEAR (frame.at (x, y), 102, 1) << preset;
    }
  }
}

TEST (Fuse, FlatLightStaysFlatUnderEverySchedule)
{
  for (const char *preset : kSchedules) {
    const Schedule schedule = schedule_of (preset);
    const auto coded = take<std::uint16_t> (schedule, 2, [] (int) {
      return draw<std::uint16_t> (40, 35, [] (int, int) { return 0.4; });
    });
    for (const FuseQuality quality : kUnlearned) {
      SCOPED_TRACE (
          std::string (preset) + " " + std::string (quality_name (quality)));
      for (const auto &frame : fuse (coded, schedule, with_quality (quality)))
        for (int y = 0; y < frame.height (); y++)
          for (int x = 0; x < frame.width (); x++)
            ASSERT_NEAR (frame.at (x, y), 0.4 * 65535, 25.0) << x << ' ' << y;
    }
  }
}

TEST (Fuse, PixelsStayAsTheyWereInTheirOwnSlot)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto coded = take (schedule, 2, [] (int slot) {
    return draw (
        40, 32, [slot] (int x, int y) { return texture (x - 2 * slot, y); });
  });
  for (const FuseQuality quality : kQualities) {
    const auto frames = fuse (coded, schedule, with_quality (quality));
    for (std::size_t f = 0; f < coded.size (); f++)
      for (int y = 0; y < 32; y++)
        for (int x = 0; x < 40; x++)
          ASSERT_EQ (
              frames[4 * f + std::size_t (schedule.element_at (x, y))].at (
                  x, y),
              coded[f].at (x, y))
              << quality_name (quality);
  }
}

TEST (Fuse, AStillSceneIsSeenAtFullResolution)
{
  const auto scene = draw (64, 48, texture);
  for (const char *preset : {"sequential:2x2", "sequential:lattice:4/2",
           "sequential:lattice:8/3,order=bit-reversal",
           "staircase:lattice:4/2"}) {
    SCOPED_TRACE (preset);
    const Schedule schedule = schedule_of (preset);
    const auto coded = take (schedule, 2, [&] (int) { return scene; });
    for (const FuseQuality quality : kQualities) {
      const auto frames = fuse (coded, schedule, with_quality (quality));
      for (std::size_t k = frames.size () / 2; k < frames.size (); k++)
        EXPECT_GT (psnr (frames[k], scene), 45.0) << quality_name (quality);
    }
  }
}

TEST (Fuse, LookaheadKnowsTheFirstFrameStandsStill)
{
  const auto scene = draw (64, 48, texture);
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto coded = take (schedule, 2, [&] (int) { return scene; });
  FuseOptions options;
  options.lookahead = 1;
  for (const auto &frame : fuse (coded, schedule, options))
    EXPECT_GT (psnr (frame, scene), 45.0);
}

/* Standard deviation over the slots of a frame, the largest of all pixels'
 * root mean square. */
double
flicker (std::span<const Image<std::uint8_t>> slots)
{
  double sum = 0.0;
  const auto n = double (slots.size ());
  for (int y = 0; y < slots[0].height (); y++) {
    for (int x = 0; x < slots[0].width (); x++) {
      double mean = 0.0, squares = 0.0;
      for (const auto &slot : slots) {
        mean += slot.at (x, y) / n;
        squares += slot.at (x, y) * double (slot.at (x, y)) / n;
      }
      sum += squares - mean * mean;
    }
  }
  return std::sqrt (sum / (slots[0].width () * slots[0].height ()));
}

TEST (Fuse, AStillSceneDoesNotFlickerUnderNoise)
{
  const auto scene = draw (64, 48, texture);
  for (const char *preset :
      {"sequential:lattice:4/2", "sequential:lattice:8/3,order=bit-reversal"}) {
    const Schedule schedule = schedule_of (preset);
    const auto coded = take (
        schedule, 4, [&] (int) { return scene; }, noisy_bench ());
    const auto n = std::size_t (schedule.slots ());
    const auto frames =
        fuse (coded, schedule, with_quality (FuseQuality::kFast, true));
    for (std::size_t f = 1; f < 4; f++)
      EXPECT_LT (flicker (std::span (frames).subspan (f * n, n)), 1.0)
          << preset << " frame " << f;
  }
}

TEST (Fuse, StillLightIsAveragedOverFramesWhereNoiseIsKnown)
{
  const auto scene = draw (64, 48, texture);
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto coded = take (
      schedule, 12, [&] (int) { return scene; }, noisy_bench ());
  const auto frames =
      fuse (coded, schedule, with_quality (FuseQuality::kFast, true));
  EXPECT_GT (psnr (frames.back (), scene), 45.0);
  EXPECT_LT (psnr (coded.back (), scene), 39.0);
}

/* Like a lamp that warms up: static pixels must not lag. */
TEST (Fuse, StillLightThatGrowsSlowlyIsFollowed)
{
  constexpr double kGrowth = 0.03 / 255.0; // a frame
  constexpr int kFrames = 120;
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto n = schedule.slots ();
  const auto scene = [&] (int slot) {
    return draw<std::uint16_t> (48, 32, [&] (int x, int y) {
      return 0.7 * texture (x, y) + kGrowth * (slot / n);
    });
  };
  const auto frames = fuse (take<std::uint16_t> (schedule, kFrames, scene),
      schedule, with_quality (FuseQuality::kFast, true));
  const auto truth = scene (kFrames * n - 1);
  double sum = 0.0;
  for (int y = 4; y < 28; y++)
    for (int x = 4; x < 44; x++)
      sum += frames.back ().at (x, y) - double (truth.at (x, y));
  const double lag = -sum / (24 * 40) / 257.0; // grey levels of 255
  EXPECT_LT (lag, 0.6) << "some sixteen frames";
  EXPECT_GT (lag, 0.2) << "it is averaged";
}

/* A small disc crosses a static texture. */
Image<std::uint8_t>
disc_over_texture (int slot)
{
  return draw (96, 48, [slot] (int x, int y) {
    return std::hypot (x - 8 - 3 * slot, y - 24) < 4.0 ? 1.0
                                                       : 0.5 * texture (x, y);
  });
}

/* Overlapping soft discs of several sizes and greys that move by @speed px per
 * slot. */
Image<std::uint8_t>
discs (double speed, int slot)
{
  const auto places = random_numbers (400, 6);
  return draw (96, 64, [&] (int x, int y) {
    double value = 0.5;
    for (std::size_t i = 0; i + 3 < places.size (); i += 4) {
      const double radius = 3.0 + std::abs (places[i + 2]) / 10.0;
      const double away =
          std::hypot (x - 48 - 0.7 * double (places[i]) - speed * slot,
              y - 32 - 0.5 * double (places[i + 1]));
      const double grey = 0.5 + double (places[i + 3]) / 250.0;
      value += (grey - value) * std::clamp (radius - away, 0.0, 1.0);
    }
    return value;
  });
}

/* PSNR of four slots of them. */
double
discs_fused (double speed)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto picture = [speed] (int slot) { return discs (speed, slot); };
  const auto frames = fuse (take (schedule, 1, picture), schedule);
  double sum = 0.0;
  for (int slot = 0; slot < 4; slot++)
    sum += psnr (frames[std::size_t (slot)], picture (slot));
  return sum / 4.0;
}

/* The slow model alone gives 32.9 and 26.1 dB, the moving one 28.8 dB. */
TEST (Fuse, FastTakesTheModelThatFits)
{
  EXPECT_GT (discs_fused (0.1), (32.9 + 28.8) / 2.0);
  EXPECT_GT (discs_fused (2.0), (26.1 + 28.8) / 2.0);
}

/* PSNR of the second of three coded frames of discs(), with the neighbours that
 * fusion takes. */
struct WithNeighbours {
  double none, previous, both;
};

WithNeighbours
second_frame (double speed, FuseQuality quality)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto picture = [speed] (int slot) { return discs (speed, slot); };
  const auto coded = take (schedule, 3, picture);
  const auto mean = [&] (const Pictures<> &frames, std::size_t first) {
    double sum = 0.0;
    for (std::size_t s = 0; s < 4; s++)
      sum += psnr (frames[first + s], picture (int (4 + s))) / 4.0;
    return sum;
  };
  FuseOptions options = with_quality (quality);
  const double none =
      mean (fuse<std::uint8_t> ({coded[1]}, schedule, options), 0);
  const double previous = mean (fuse (coded, schedule, options), 4);
  options.lookahead = 1;
  return {none, previous, mean (fuse (coded, schedule, options), 4)};
}

TEST (Fuse, NeighbouringFramesHelpWhatMovesSlowly)
{
  for (const FuseQuality quality : kUnlearned) {
    SCOPED_TRACE (quality_name (quality));
    const WithNeighbours psnr = second_frame (0.1, quality);
    EXPECT_GT (psnr.previous, psnr.none + 0.1);
    EXPECT_GT (psnr.both, psnr.previous + 0.2);
  }
}

TEST (Fuse, TheFrameBeforeHelpsWhatMovesFaster)
{
  for (const FuseQuality quality :
      {FuseQuality::kBalanced, FuseQuality::kBest}) {
    SCOPED_TRACE (quality_name (quality));
    const WithNeighbours psnr = second_frame (0.5, quality);
    EXPECT_GT (psnr.previous, psnr.none + 0.3);
    EXPECT_GT (psnr.both, psnr.previous - 0.1);
  }
}

/* What moves evenly is seen before the first slot and after the last one in
 * other coded frames. With pixels of these near its place only, the ends are up
 * to 1.5 dB below the others. */
TEST (Fuse, TheEndsOfAnExposureAreHardlyWorseThanItsMiddle)
{
  const Schedule schedule =
      schedule_of ("sequential:lattice:8/3,order=bit-reversal");
  for (const double speed : {1.0, 3.0}) {
    const auto picture = [speed] (int slot) {
      return draw (
          96, 64, [&] (int x, int y) { return texture (x - speed * slot, y); });
    };
    FuseOptions options = with_quality (FuseQuality::kBalanced);
    options.lookahead = 1;
    const auto frames = fuse (take (schedule, 3, picture), schedule, options);
    std::vector<double> psnrs;
    for (int slot = 8; slot < 16; slot++)
      psnrs.push_back (psnr (frames[std::size_t (slot)], picture (slot)));
    const double between =
        std::accumulate (psnrs.begin () + 1, psnrs.end () - 1, 0.0) / 6.0;
    EXPECT_GT (psnrs.front (), between - 0.75) << speed;
    EXPECT_GT (psnrs.back (), between - 0.75) << speed;
  }
}

TEST (Fuse, WhatMovesLeavesNoGhosts)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto coded = take (schedule, 6, disc_over_texture);
  for (const FuseQuality quality : kQualities) {
    const auto frames = fuse (coded, schedule, with_quality (quality));
    for (int slot = 4; slot < 24; slot++) {
      const auto truth = disc_over_texture (slot);
      const auto &frame = frames[std::size_t (slot)];
      double worst = 0.0;
      for (int y = 0; y < 48; y++) {
        for (int x = 0; x < 96; x++) {
          const double d = std::hypot (x - 8 - 3 * slot, y - 24);
          if (d > 9.0) // beyond the edge and what blurs it
            worst = std::max (
                worst, std::abs (frame.at (x, y) - double (truth.at (x, y))));
        }
      }
      EXPECT_LT (worst, 70.0) << quality_name (quality) << ' ' << slot;
    }
  }
}

/* Stripes that return to the same position in every coded frame. */
Image<std::uint8_t>
stripes (int slot)
{
  return draw (64, 48, [slot] (int x, int) {
    return 0.5 +
           0.35 * std::sin (2.0 * std::numbers::pi * (x / 5.0 - slot / 4.0));
  });
}

TEST (Fuse, WhatRepeatsWithTheFrameRateIsNotTakenForStill)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto frames = fuse (take (schedule, 3, stripes), schedule);
  for (std::size_t slot = 4; slot < frames.size (); slot++)
    EXPECT_GT (psnr (frames[slot], stripes (int (slot))),
        psnr (frames[slot % 4], stripes (int (slot % 4))) - 1.0);
}

TEST (Fuse, ForgottenFramesHaveNoSay)
{
  const Schedule schedule;
  const auto scene = draw (40, 24, texture);
  const auto coded = take (schedule, 1, [&] (int) { return scene; });
  for (const FuseQuality quality : kQualities) {
    FuseOptions options;
    options.quality = quality;
    auto fuser = Fuser<std::uint8_t>::make (schedule, 40, 24, options);
    ASSERT_TRUE (fuser);
    const auto once = [&] {
      Pictures<> slots (4, Image<std::uint8_t> (40, 24));
      std::vector<ImageView<std::uint8_t>> views;
      for (auto &slot : slots)
        views.push_back (slot.view ());
      EXPECT_TRUE (fuser->take (coded[0].view ()));
      EXPECT_TRUE (fuser->fuse (views));
      return slots;
    };
    const auto first = once ();
    EXPECT_NE (once (), first);
    fuser->forget ();
    EXPECT_EQ (once (), first) << int (quality);
  }
}

TEST (Fuse, SixteenBitsAreFinerThanEight)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto picture = [] (int) {
    return draw<std::uint16_t> (48, 48, [] (int x, int y) {
      return 0.5 + 0.004 * std::sin (0.1 * x) * std::cos (0.08 * y);
    });
  };
  const auto coded = take<std::uint16_t> (schedule, 1, picture);
  for (const auto &frame : fuse (coded, schedule))
    EXPECT_GT (psnr (frame, picture (0)), 62.0);
}

/* --------------------------------------------------------------- errors -- */

std::string
error_of (const std::string &preset, int width, int height,
    const FuseOptions &options = {})
{
  const auto made =
      Fuser<std::uint8_t>::make (schedule_of (preset), width, height, options);
  return made ? "" : made.error ().message;
}

TEST (Fuse, RefusesWhatItCannotDo)
{
  FuseOptions options;
  EXPECT_NE (
      error_of ("sequential:4x4", 3, 8).find ("no cell"), std::string::npos);
  options.bits = 9;
  EXPECT_NE (error_of ("sequential:2x2", 8, 8, options).find ("bits 9"),
      std::string::npos);
  options = {};
  options.lookahead = 2;
  EXPECT_NE (error_of ("sequential:2x2", 8, 8, options).find ("lookahead 2"),
      std::string::npos);
  options = {};
  options.threads = 65;
  EXPECT_NE (error_of ("sequential:2x2", 8, 8, options).find ("threads 65"),
      std::string::npos);
  options = with_quality (FuseQuality::kBest);
  EXPECT_NE (error_of ("sequential:5x5", 32, 32, options).find ("quality=fast"),
      std::string::npos);
  EXPECT_EQ (error_of ("sequential:5x5", 32, 32), "");
}

/* 2x2 groups, each with another order of elements. */
TEST (Fuse, RefusesTilesThatHardlyRepeat)
{
  constexpr int kPeriod = 80;
  std::mt19937 engine (9);
  std::vector<std::uint8_t> labels (kPeriod * kPeriod);
  for (int y = 0; y < kPeriod; y += 2) {
    for (int x = 0; x < kPeriod; x += 2) {
      std::uint8_t mixed[] = {0, 1, 2, 3};
      std::shuffle (mixed, mixed + 4, engine);
      for (int i = 0; i < 4; i++)
        labels[std::size_t ((y + i / 2) * kPeriod + x + i % 2)] = mixed[i];
    }
  }
  Schedule::Parts parts{*Tile::from_labels (kPeriod, kPeriod, labels),
      *Code::named ("sequential", 4)};
  const auto made =
      Fuser<std::uint8_t>::make (*Schedule::make (parts), 160, 160);
  ASSERT_FALSE (made);
  EXPECT_NE (made.error ().message.find ("smaller period"), std::string::npos);
}

} // namespace

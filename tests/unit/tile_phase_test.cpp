/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The phase of the tile, measured from a coded frame. */
#include "calibrate/tile_phase.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "bench/bench.h"

using namespace codedexposure;

namespace
{

Schedule
schedule_of (const std::string &preset)
{
  const auto schedule = Schedule::from_preset (preset);
  EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
  return *schedule;
}

/** A textured scene that moves, through noise, a lens and the mirrors. */
Image<std::uint8_t>
coded (const Schedule &schedule, double brightness, std::uint64_t seed)
{
  const int width = 192, height = 160;
  BenchOptions options;
  options.psf_sigma = 0.5;
  options.full_well = 10000;
  options.read_noise = 5;
  options.seed = seed;
  auto bench = OpticalBench::make (width, height, options);
  bench->begin (schedule);
  Image<std::uint8_t> scene (width, height);
  for (int slot = 0; slot < schedule.slots (); slot++) {
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++)
        scene.at (x, y) = std::uint8_t (
            brightness *
            (1.0 + 0.3 * std::sin (0.9 * (x - 2 * slot) + 0.2 * y) +
                0.3 * std::sin (0.05 * x + 0.11 * y) + 0.3 * x / width));
    bench->expose (std::as_const (scene).view (), slot, 1.0);
  }
  Image<std::uint8_t> frame (width, height);
  bench->read_out (0, frame.view ());
  return frame;
}

} // namespace

TEST (TilePhase, FoundInOneFrameOfAStaircase)
{
  for (const char *tile : {"2x2", "3x3", "4x2", "lattice:4/2", "lattice:8/3"})
    for (const Offset phase : {Offset{0, 0}, Offset{1, 0}, Offset{1, 1}}) {
      const std::string preset = std::string ("staircase:") + tile;
      const auto truth =
          schedule_of (preset + ",phase=" + std::to_string (phase.x) + "/" +
                       std::to_string (phase.y));
      const auto frame = coded (truth, 90, 3);
      const auto found = find_tile_phase (frame.view (), schedule_of (preset));
      ASSERT_TRUE (found.ok ()) << found.error ().message;
      /* Several phases of a lattice are the same arrangement. */
      EXPECT_EQ (truth.tile ().label (found->phase.x, found->phase.y),
          truth.tile ().label (phase.x, phase.y))
          << preset;
      EXPECT_GT (found->confidence, 0.99) << preset;
      EXPECT_GT (found->contrast, 0.1) << preset;
      EXPECT_LT (found->contrast, 1.0) << preset;
    }
}

TEST (TilePhase, ConfidenceIsLowWhereTheFrameSaysLittle)
{
  const auto schedule = schedule_of ("staircase:2x2");
  Image<std::uint8_t> frame (128, 128);
  std::mt19937 random (7);
  for (int y = 0; y < 128; y++)
    for (int x = 0; x < 128; x++)
      frame.at (x, y) = std::uint8_t (100 + random () % 40);
  const auto found = find_tile_phase (std::as_const (frame).view (), schedule);
  ASSERT_TRUE (found.ok ()) << found.error ().message;
  EXPECT_LT (found->confidence, 0.9);
  EXPECT_LT (found->contrast, 0.05);
}

TEST (TilePhase, IsRightAsOftenAsConfidencePromises)
{
  /* Hardly any light: the frame is mostly noise. */
  const auto schedule = schedule_of ("staircase:2x2");
  std::mt19937 random (11);
  std::normal_distribution<double> noise (0.0, 12.0);
  double promised = 0.0;
  int right = 0;
  const int frames = 300;
  for (int n = 0; n < frames; n++) {
    Image<std::uint8_t> frame (48, 48);
    for (int y = 0; y < 48; y++)
      for (int x = 0; x < 48; x++)
        frame.at (x, y) = std::uint8_t (std::clamp (
            60.0 + 0.8 * schedule.element_at (x, y) + noise (random), 0.0,
            255.0));
    const auto found =
        find_tile_phase (std::as_const (frame).view (), schedule);
    right += found->phase == Offset{};
    promised += found->confidence;
  }
  EXPECT_GT (promised, 0.5 * frames);
  EXPECT_LT (promised, 0.95 * frames);
  EXPECT_GT (right, promised - 0.05 * frames);
}

TEST (TilePhase, SaysWhereThereIsNoneToBeFound)
{
  Image<std::uint8_t> frame (64, 64);
  EXPECT_NE (find_tile_phase (std::as_const (frame).view (), Schedule ())
                 .error ()
                 .message.find ("get the same light"),
      std::string::npos);
  EXPECT_NE (find_tile_phase (
                 std::as_const (frame).view (), schedule_of ("staircase:16x16"))
                 .error ()
                 .message.find ("less than 8x8 periods"),
      std::string::npos);
}

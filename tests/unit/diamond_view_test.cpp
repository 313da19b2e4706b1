/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The simulated bench with rotated mirrors images the masks that a device would
 * show. */
#include <cmath>

#include <gtest/gtest.h>

#include "bench/bench.h"
#include "diamond.h"
#include "dmd/plane_image.h"
#include "dmd/simulated_dmd.h"
#include "mirrors.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

/** Pixels of the camera; the array has at least as many mirrors. */
constexpr int kWidth = 24, kHeight = 20;

Schedule
parsed (const char *preset)
{
  const auto schedule = Schedule::parse (preset);
  EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
  return *schedule;
}

/** Addresses that the camera sees. */
Extent
array_of (MirrorLayout layout)
{
  return {kWidth, layout == MirrorLayout::cell ? 2 * kHeight : kHeight};
}

/** The mirrors of a mask as a device has them in its memory: plane by plane. */
Image<std::uint8_t>
sent_mirrors (const Schedule &schedule, int mask, const Placement &placement)
{
  const PlanePlan plan = plan_planes (schedule);
  const PlaneSlot at = plan.masks[std::size_t (mask)];
  const PlaneImage planes = rendered_planes (
      schedule, plan, at.image, array_of (placement.layout), placement)
                                .image ();
  Image<std::uint8_t> mirrors (planes.width (), planes.height ());
  for (int y = 0; y < mirrors.height (); y++)
    for (int x = 0; x < mirrors.width (); x++)
      mirrors.at (x, y) = planes.at (x, y) >> at.plane & 1;
  return mirrors;
}

/** Whether a mirror that is on covers @p point; tries every mirror. */
bool
lit (const Image<std::uint8_t> &mirrors, Position point)
{
  for (int row = 0; row < mirrors.height (); row++)
    for (int column = 0; column < mirrors.width (); column++) {
      const Position at = mirror_position (Array::diamond, column, row);
      // A square rotated by 45 degrees, half a pitch from centre to corner.
      if (std::abs (point.x - at.x) + std::abs (point.y - at.y) < 0.5)
        return mirrors.at (column, row) != 0;
    }
  return false;
}

/** The image of a mask in uniform light; 255 for a fully lit pixel. */
Image<std::uint8_t>
seen (const Schedule &schedule, int mask, MirrorLayout layout)
{
  BenchOptions options;
  options.diamond = layout;
  options.gain = schedule.slots ();
  auto bench = OpticalBench::make (kWidth, kHeight, options);
  EXPECT_TRUE (bench.ok ());
  Image<std::uint8_t> scene (kWidth, kHeight), coded (kWidth, kHeight);
  for (int y = 0; y < kHeight; y++)
    for (int x = 0; x < kWidth; x++)
      scene.at (x, y) = 255;
  const Image<std::uint8_t> &light = scene;
  bench->begin (schedule);
  bench->expose (light.view (), mask, 1.0);
  bench->read_out (0, coded.view ());
  return coded;
}

struct Case {
  MirrorLayout layout;
  const char *schedule;
};

class Diamond : public ::testing::TestWithParam<Case>
{
};

} // namespace

TEST_P (Diamond, TheBenchSeesTheMirrorsThatADeviceIsSent)
{
  const auto &[layout, preset] = GetParam ();
  const Schedule schedule = parsed (preset);
  for (int mask = 0; mask < schedule.masks (); mask++) {
    const auto mirrors = sent_mirrors (schedule, mask, {.layout = layout});
    const auto coded = seen (schedule, mask, layout);
    int bright = 0;
    for (int y = 2; y < kHeight - 2; y += 5)
      for (int x = 2; x < kWidth - 2; x++) {
        constexpr int kSamples = 15;
        int on = 0;
        for (int j = 0; j < kSamples; j++)
          for (int i = 0; i < kSamples; i++)
            on += lit (
                mirrors, tile_place (layout, x + (i + 0.37) / kSamples - 0.5,
                             y + (j + 0.59) / kSamples - 0.5));
        const double share = double (on) / (kSamples * kSamples);
        ASSERT_NEAR (coded.at (x, y) / 255.0, share, 0.06)
            << "mask " << mask << " at " << x << ", " << y;
        bright += share > 0.4;
      }
    EXPECT_GT (bright, 0) << mask;
  }
}

INSTANTIATE_TEST_SUITE_P (Layouts, Diamond,
    ::testing::Values (Case{MirrorLayout::address, "sequential:2x2"},
        Case{MirrorLayout::cell, "sequential:2x2"},
        Case{MirrorLayout::cell, "staircase:3x2"},
        Case{MirrorLayout::cell, "sequential:2x2,pilot=6"}));

TEST (DiamondLattice, EachPixelIsAMirrorOfItsOwn)
{
  const Schedule schedule = parsed ("staircase:2x2");
  Image<std::uint8_t> mask (kWidth, kHeight);
  for (int slot = 0; slot < schedule.masks (); slot++) {
    expected_mask (schedule, slot, mask.view ());
    const auto coded = seen (schedule, slot, MirrorLayout::lattice);
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++)
        ASSERT_EQ (coded.at (x, y), mask.at (x, y) * 255) << x << ", " << y;
  }
}

TEST (DiamondLattice, ATilePixelIsTheMirrorAtItsPlace)
{
  for (const MirrorLayout layout :
      {MirrorLayout::address, MirrorLayout::lattice, MirrorLayout::cell})
    for (int row = -6; row < 20; row++)
      for (int column = -6; column < 20; column++) {
        EXPECT_EQ (mirror_at (mirror_position (Array::diamond, column, row)),
            (Offset{column, row}));
        const Offset pixel = tile_pixel (layout, column, row);
        const Position centre = tile_place (layout, pixel.x, pixel.y);
        const Position mirror = mirror_position (Array::diamond, column, row);
        EXPECT_LE (std::hypot (centre.x - mirror.x, centre.y - mirror.y), 0.36);
      }
}

TEST (SimulatedDiamond, CarriesItsLayoutToTheBench)
{
  const auto mirrors = SimulatedMirrors::find ("diamond");
  auto dmd = open_simulated_dmd ("sim:diamond,layout=cell");
  ASSERT_TRUE (dmd.ok ());
  EXPECT_EQ ((*dmd)->info ().array, Array::diamond);
  EXPECT_EQ (mirrors->shape ().diamond, MirrorLayout::cell);
  dmd->reset ();
  const auto plain = open_simulated_dmd ("sim:diamond");
  EXPECT_EQ (mirrors->shape ().diamond, std::nullopt);
  EXPECT_FALSE (open_simulated_dmd ("sim:diamond,layout=x").ok ());
}

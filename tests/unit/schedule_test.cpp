/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The schedule as a value, its masks and its sample positions. */
#include "schedule/schedule.h"

#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "mirrors.h"
#include "schedule/sample_grid.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

constexpr Extent kSizes[] = {{1, 1}, {7, 5}, {16, 9}, {13, 32}};
constexpr const char *kPresets[] = {"sequential:2x2", "staircase:3x2",
    "s-matrix:7x1,phase=3/0", "sequential:lattice:8/3,order=bit-reversal",
    "staircase:lattice:5/2,phase=1/4", "s-matrix:4x4,order=raster,phase=5/2",
    "sequential:diamond:13", "sequential:lattice:4/2,pilot=2",
    "staircase:2x2,pilot=3,phase=1/1"};

Schedule
preset (const std::string &text)
{
  auto schedule = Schedule::from_preset (text);
  EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
  return schedule.ok () ? *schedule : Schedule ();
}

Schedule::Parts
parts_of (const char *tile, const char *code)
{
  const Tile parsed = *Tile::parse (tile);
  return {parsed, *Code::named (code, parsed.elements ())};
}

void
expect_error (Schedule::Parts parts, std::vector<std::string> words)
{
  const auto schedule = Schedule::make (std::move (parts));
  ASSERT_FALSE (schedule.ok ());
  for (const std::string &word : words)
    EXPECT_NE (schedule.error ().message.find (word), std::string::npos)
        << "'" << word << "' in: " << schedule.error ().message;
}

} // namespace

TEST (Schedule, DefaultIsSequentialTwoByTwo)
{
  const Schedule schedule;
  EXPECT_EQ (schedule, preset ("sequential:2x2"));
  EXPECT_EQ (schedule.elements (), 4);
  EXPECT_EQ (schedule.slots (), 4);
  EXPECT_EQ (schedule.masks (), 4);
  EXPECT_EQ (schedule.cell (), (Extent{2, 2}));
  EXPECT_EQ (schedule.timing (), Timing{});
  EXPECT_EQ (schedule.order (), (std::vector{0, 1, 2, 3}));
}

TEST (Schedule, OrderGivesEachLabelItsElement)
{
  auto parts = parts_of ("2x2", "sequential");
  parts.order = {2, 0, 3, 1};
  const auto schedule = Schedule::make (parts);
  ASSERT_TRUE (schedule.ok ());
  EXPECT_EQ (schedule->element_at (0, 0), 2);
  EXPECT_EQ (schedule->element_at (1, 0), 0);
  EXPECT_EQ (schedule->element_at (0, 1), 3);
  EXPECT_EQ (schedule->element_at (1, 1), 1);
  EXPECT_EQ (schedule->element_at (6, 9), 3);
}

TEST (Schedule, PhaseIsWherePixelZeroLiesInTheTile)
{
  auto parts = parts_of ("4x2", "sequential");
  parts.phase = {3, 1};
  const auto schedule = Schedule::make (parts);
  ASSERT_TRUE (schedule.ok ());
  EXPECT_EQ (schedule->element_at (0, 0), 7);
  EXPECT_EQ (schedule->element_at (1, 0), 4);
  EXPECT_EQ (schedule->element_at (0, 1), 3);
  EXPECT_EQ (schedule->element_at (1, 1), 0);
  EXPECT_EQ (schedule->cell (), (Extent{4, 2}));
}

TEST (Schedule, WrongPartsAreNamed)
{
  const auto good = parts_of ("2x2", "sequential");
  auto parts = good;
  parts.code = *Code::named ("staircase", 3);
  expect_error (parts, {"'staircase' has 3", "'2x2' has 4", "as many"});

  parts = good;
  parts.order = {0, 1, 2};
  expect_error (parts, {"order with 3 entries for 4 labels"});
  parts.order = {0, 1, 2, 4};
  expect_error (parts, {"element 4", "0..3"});
  parts.order = {0, 1, -2, 3};
  expect_error (parts, {"element -2", "0..3"});
  parts.order = {0, 1, 1, 3};
  expect_error (parts, {"element 1 twice", "permutation"});

  parts = good;
  parts.timing.active = -1;
  expect_error (parts, {"active of -1 ns", "negative", "below an hour"});
  parts.timing = {0, kTimeLimit, 0};
  expect_error (parts, {"switching of 3600000000000 ns", "below an hour"});
  parts.timing = {0, 0, -5};
  expect_error (parts, {"readout of -5 ns"});

  for (const double leak : {-0.01, 0.51, 1e300, double (INFINITY)}) {
    parts = good;
    parts.leak = leak;
    expect_error (parts, {"leak ", "0..0.5"});
  }
  parts.leak = NAN;
  expect_error (parts, {"leak nan", "0..0.5"});

  parts = good;
  parts.phase = {-1, 0};
  expect_error (parts, {"phase -1/0", "0..16384"});
  parts.phase = {0, 16385};
  expect_error (parts, {"phase 0/16385", "0..16384"});
  parts = good;
  parts.pilot_rows = -1;
  expect_error (parts, {"pilot of -1 rows", "0..16384"});

  parts = {
      *Tile::from_labels (4, 1, {0, 1, 1, 0}), *Code::named ("sequential", 2)};
  EXPECT_TRUE (Schedule::make (parts).ok ());
  parts.phase = {1, 0};
  expect_error (parts, {"'labels'", "phase 1/0", "no cell"});
}

TEST (Mask, EveryMirrorFollowsTheCode)
{
  for (const char *text : kPresets) {
    const Schedule schedule = preset (text);
    for (const Extent size : kSizes) {
      const int lit_rows = size.height - schedule.pilot_rows ();
      for (int mask = 0; mask < schedule.masks (); mask++) {
        const auto image = rendered_mask (schedule, mask, size);
        for (int y = 0; y < lit_rows; y++)
          for (int x = 0; x < size.width; x++)
            ASSERT_EQ (image.at (x, y),
                schedule.code ().on (
                    schedule.element_at (x, y), mask % schedule.slots ()))
                << text << " mask " << mask << " mirror " << x << ", " << y;
      }
    }
  }
}

TEST (Mask, OfTheDefaultSchedule)
{
  const Schedule schedule;
  for (int mask = 0; mask < 4; mask++) {
    const auto image = rendered_mask (schedule, mask, {5, 3});
    for (int y = 0; y < 3; y++)
      for (int x = 0; x < 5; x++)
        EXPECT_EQ (image.at (x, y), x % 2 + 2 * (y % 2) == mask ? 1 : 0);
  }
}

TEST (Mask, SumOverSlotsIsTheExposureOfTheElement)
{
  for (const char *text : kPresets) {
    const Schedule schedule = preset (text);
    for (const Extent size : kSizes) {
      Image<int> sum (size.width, size.height);
      for (int mask = 0; mask < schedule.slots (); mask++) {
        const auto image = rendered_mask (schedule, mask, size);
        for (int y = 0; y < size.height; y++)
          for (int x = 0; x < size.width; x++)
            sum.at (x, y) += image.at (x, y);
      }
      for (int y = 0; y < size.height - schedule.pilot_rows (); y++)
        for (int x = 0; x < size.width; x++)
          ASSERT_EQ (sum.at (x, y),
              schedule.code ().on_slots (schedule.element_at (x, y)))
              << text;
    }
  }
}

TEST (Schedule, GoesOnFromALaterSlotWithTheWhiteOfTheWhole)
{
  const Schedule whole = *Schedule::parse (
      "sequential:2x2,pilot=2,region=8x8+8+8:staircase:lattice:2/1");
  const Schedule part = whole.background ();
  const Schedule later = part.from_slot (3);
  EXPECT_EQ (later.white_slots (), part.white_slots ());
  EXPECT_EQ (later.pilot_rows (), 2);
  for (int y = 0; y < 4; y++)
    for (int x = 0; x < 4; x++)
      for (int s = 0; s < 4; s++)
        ASSERT_EQ (later.on (x, y, s), part.on (x, y, (s + 3) % 4));
}

TEST (Mask, OfTheOtherBeamIsItsComplement)
{
  const Schedule schedule =
      *Schedule::from_preset ("sequential:2x2,pilot=4,leak=0.1,"
                              "region=8x8+4+4:sequential:lattice:8/3");
  const Schedule other = *schedule.complement ();
  EXPECT_EQ (other.slots (), schedule.slots ());
  const Extent size{40, 24};
  const MaskRenderer masks (schedule, size), others (other, size);
  for (int mask = 0; mask < schedule.masks (); mask++) {
    const auto shown = masks.render (mask).image ();
    const auto complement = others.render (mask).image ();
    for (int y = 0; y < size.height; y++)
      for (int x = 0; x < size.width; x++)
        ASSERT_EQ (shown.at (x, y) + complement.at (x, y), 1)
            << "mask " << mask << " at " << x << ", " << y;
  }
}

TEST (Pilot, ColumnsOfTheTwoByTwoSchedule)
{
  const Schedule schedule = preset ("sequential:2x2,pilot=1");
  const std::string open_in = "00001111222233334444555566667777";
  for (int mask = 0; mask < 8; mask++) {
    const auto image = rendered_mask (schedule, mask, {40, 5});
    for (int x = 0; x < 40; x++)
      EXPECT_EQ (image.at (x, 4), open_in[std::size_t (x % 32)] == '0' + mask)
          << "mask " << mask << " column " << x;
  }
}

TEST (Pilot, EveryColumnIsOpenInOneMaskOfTwoFrames)
{
  for (int slots = 2; slots <= 256; slots++)
    for (int x = 0; x < kPilotColumns; x++) {
      int open = 0;
      for (int mask = 0; mask < 2 * slots; mask++)
        open += pilot_on (x, mask, slots);
      EXPECT_EQ (open, 1) << slots << " slots, column " << x;
    }
}

TEST (Pilot, BothFramesAreLitOutOfPhaseOnly)
{
  for (int slots = 2; slots <= 256; slots++)
    for (int first = 0; first < 2 * slots; first++) {
      bool lit[2] = {};
      for (int slot = 0; slot < slots; slot++)
        for (int x = 0; x < kPilotColumns; x++)
          lit[x * 2 / kPilotColumns] |=
              pilot_on (x, (first + slot) % (2 * slots), slots);
      EXPECT_EQ (lit[0] && lit[1], first % slots != 0)
          << slots << " slots, mask " << first << " first";
    }
}

TEST (Pilot, TallerThanTheArrayCoversIt)
{
  const auto image =
      rendered_mask (preset ("staircase:2x2,pilot=9"), 0, {4, 3});
  for (int y = 0; y < 3; y++)
    for (int x = 0; x < 4; x++)
      EXPECT_EQ (image.at (x, y), pilot_on (x, 0, 4));
}

TEST (SampleGrid, EverySampleIsAPixelOfItsElement)
{
  for (const char *text : kPresets) {
    const Schedule schedule = preset (text);
    const SampleGrid grid (schedule);
    ASSERT_EQ (grid.elements (), schedule.elements ());
    const Extent cell = grid.cell ();
    std::map<std::pair<int, int>, int> uses;
    for (int j = 0; j < 17; j++) {
      for (int i = 0; i < 19; i++) {
        for (int e = 0; e < grid.elements (); e++) {
          const Offset d = grid.offset (e, i, j);
          ASSERT_TRUE (
              d.x >= 0 && d.x < cell.width && d.y >= 0 && d.y < cell.height);
          const int x = i * cell.width + d.x, y = j * cell.height + d.y;
          ASSERT_EQ (schedule.element_at (x, y), e) << text;
          uses[{x, y}]++;
        }
      }
    }
    EXPECT_EQ (uses.size (), std::size_t (17 * 19 * cell.width * cell.height));
  }
}

TEST (SampleGrid, RasterOffsetsAreTheSameInEveryCell)
{
  const SampleGrid grid (preset ("sequential:4x2,phase=1/1"));
  EXPECT_EQ (grid.repeat (), (Extent{1, 1}));
  EXPECT_EQ (grid.offset (0, 0, 0), (Offset{3, 1}));
  EXPECT_EQ (grid.offset (0, 5, 9), (Offset{3, 1}));
  EXPECT_EQ (grid.offset (5, 2, 2), (Offset{0, 0}));
}

TEST (SampleGrid, LatticeOffsetsRepeat)
{
  const SampleGrid grid (preset ("sequential:lattice:8/4"));
  EXPECT_EQ (grid.cell (), (Extent{4, 2}));
  EXPECT_EQ (grid.repeat (), (Extent{2, 1}));
  EXPECT_EQ (grid.offset (0, 0, 0), (Offset{0, 0}));
  EXPECT_EQ (grid.offset (0, 1, 0), (Offset{0, 1}));
  EXPECT_EQ (grid.offset (0, 2, 3), (Offset{0, 0}));
}

TEST (SampleGrid, SubframesHaveAPixelForEveryWholeCell)
{
  const auto size = [] (const char *text, int width, int height) {
    return SampleGrid (preset (text)).subframe_size (width, height);
  };
  EXPECT_EQ (size ("sequential:2x2", 768, 576), (Extent{384, 288}));
  EXPECT_EQ (size ("sequential:2x2", 769, 577), (Extent{384, 288}));
  EXPECT_EQ (size ("sequential:3x3", 768, 576), (Extent{256, 192}));
  EXPECT_EQ (size ("sequential:lattice:5/2", 768, 576), (Extent{153, 576}));
  EXPECT_EQ (size ("sequential:2x2,pilot=16", 768, 576), (Extent{384, 280}));
  EXPECT_EQ (size ("sequential:2x2,pilot=15", 768, 576), (Extent{384, 280}));
  EXPECT_EQ (size ("sequential:2x2,pilot=600", 768, 576), (Extent{384, 0}));
  EXPECT_EQ (size ("sequential:2x2", 1, 1), (Extent{0, 0}));
}

TEST (SampleGrid, GridOfTheWidestMapIsSmall)
{
  std::vector<std::uint8_t> labels;
  for (int y = 0; y < 256; y++)
    for (int x = 0; x < 256; x++)
      labels.push_back (std::uint8_t ((x + 16 * y + y / 16) % 256));
  auto tile = Tile::from_labels (256, 256, labels);
  ASSERT_TRUE (tile.ok ());
  const auto schedule =
      Schedule::make ({*tile, *Code::named ("sequential", 256)});
  ASSERT_TRUE (schedule.ok ()) << schedule.error ().message;
  const SampleGrid grid (*schedule);
  EXPECT_EQ (grid.repeat ().width * grid.cell ().width, 256);
  EXPECT_EQ (grid.repeat ().height * grid.cell ().height, 256);
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Label maps, their names and their cells. */
#include "schedule/tile.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include <gtest/gtest.h>

using namespace codedexposure;

namespace
{

std::vector<int>
row_of (const Tile &tile, int y, int count)
{
  std::vector<int> labels;
  for (int x = 0; x < count; x++)
    labels.push_back (tile.label (x, y));
  return labels;
}

/** Whether the block at every cell of a wide area holds each label once. */
bool
tiles_by (const Tile &tile, Offset phase, Extent block)
{
  std::vector<int> count (std::size_t (tile.elements ()));
  for (int top = 0; top < 3 * tile.period_y (); top += block.height) {
    for (int left = 0; left < 3 * tile.period_x (); left += block.width) {
      std::fill (count.begin (), count.end (), 0);
      for (int y = 0; y < block.height; y++)
        for (int x = 0; x < block.width; x++)
          count[std::size_t (
              tile.label (left + x + phase.x, top + y + phase.y))]++;
      if (count != std::vector<int> (count.size (), 1))
        return false;
    }
  }
  return true;
}

/** The cell found by trying every block there is. */
std::optional<Extent>
squarest_block (const Tile &tile, Offset phase)
{
  const int n = tile.elements ();
  std::optional<Extent> best;
  for (int width = n; width >= 1; width--) {
    const Extent block{width, n / width};
    if (n % width != 0 || !tiles_by (tile, phase, block))
      continue;
    if (!best || std::abs (block.width - block.height) <
                     std::abs (best->width - best->height))
      best = block;
  }
  return best;
}

Tile
named (const std::string &name)
{
  auto tile = Tile::parse (name);
  EXPECT_TRUE (tile.ok ()) << name << ": " << tile.error ().message;
  EXPECT_EQ (tile->name (), name);
  return *tile;
}

void
expect_cell (const Tile &tile, Offset phase)
{
  const auto cell = tile.cell (phase);
  ASSERT_TRUE (cell.ok ()) << tile.name () << ": " << cell.error ().message;
  const auto best = squarest_block (tile, phase);
  ASSERT_TRUE (best) << tile.name ();
  EXPECT_EQ (*cell, *best) << tile.name () << " at phase " << phase.x << "/"
                           << phase.y << ": " << cell->width << "x"
                           << cell->height << " instead of " << best->width
                           << "x" << best->height;
}

} // namespace

TEST (Tile, RasterLabelsRunAlongRows)
{
  const Tile tile = named ("4x2");
  EXPECT_EQ (tile.elements (), 8);
  EXPECT_EQ (tile.period_x (), 4);
  EXPECT_EQ (tile.period_y (), 2);
  EXPECT_EQ (row_of (tile, 0, 6), (std::vector{0, 1, 2, 3, 0, 1}));
  EXPECT_EQ (row_of (tile, 1, 6), (std::vector{4, 5, 6, 7, 4, 5}));
  EXPECT_EQ (row_of (tile, 2, 4), (std::vector{0, 1, 2, 3}));
  EXPECT_EQ (tile.label (-1, -1), 7);
  EXPECT_EQ (tile.label (-4, -2), 0);
}

TEST (Tile, LatticeRowsAreShiftedByTheStep)
{
  const Tile tile = named ("lattice:8/3");
  EXPECT_EQ (tile.elements (), 8);
  EXPECT_EQ (row_of (tile, 0, 8), (std::vector{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ (row_of (tile, 1, 8), (std::vector{3, 4, 5, 6, 7, 0, 1, 2}));
  EXPECT_EQ (row_of (tile, 2, 8), (std::vector{6, 7, 0, 1, 2, 3, 4, 5}));
  EXPECT_EQ (row_of (tile, -1, 3), (std::vector{5, 6, 7}));
  EXPECT_EQ (tile.period_y (), 8);
  EXPECT_EQ (named ("lattice:4/2").period_y (), 2);
  EXPECT_EQ (named ("lattice:4/0").period_y (), 1);
}

TEST (Tile, LatticeFiveTwoIsThePlusShape)
{
  const Tile tile = named ("lattice:5/2");
  for (int y = -5; y < 5; y++) {
    for (int x = -5; x < 5; x++) {
      std::vector<int> plus{tile.label (x, y), tile.label (x - 1, y),
          tile.label (x + 1, y), tile.label (x, y - 1), tile.label (x, y + 1)};
      std::sort (plus.begin (), plus.end ());
      EXPECT_EQ (plus, (std::vector{0, 1, 2, 3, 4}));
    }
  }
}

TEST (Tile, DiamondGroupsHoldEachLabelOnce)
{
  for (int r = 1; r <= 10; r++) {
    const int n = 2 * r * r + 2 * r + 1;
    const Tile tile = named ("diamond:" + std::to_string (n));
    ASSERT_EQ (tile.elements (), n);
    for (const Offset centre : {Offset{0, 0}, Offset{3, -7}, Offset{100, 41}}) {
      std::vector<int> count (std::size_t (n), 0);
      for (int y = -r; y <= r; y++)
        for (int x = -r; x <= r; x++)
          if (std::abs (x) + std::abs (y) <= r)
            count[std::size_t (tile.label (centre.x + x, centre.y + y))]++;
      EXPECT_EQ (count, std::vector<int> (std::size_t (n), 1)) << n;
    }
  }
}

TEST (Tile, LabelsRepeatWithThePeriod)
{
  for (const char *name : {"3x2", "lattice:6/2", "lattice:9/3", "diamond:25"}) {
    const Tile tile = named (name);
    for (int y = -9; y < 9; y++)
      for (int x = -9; x < 9; x++) {
        EXPECT_EQ (tile.label (x, y), tile.label (x + tile.period_x (), y));
        EXPECT_EQ (tile.label (x, y), tile.label (x, y - tile.period_y ()));
      }
  }
}

TEST (Tile, CellOfEveryRasterIsItsGroup)
{
  for (int width = 1; width <= Tile::kMaxElements; width++) {
    for (int height = 1; width * height <= Tile::kMaxElements; height++) {
      if (width * height < 2)
        continue;
      const auto tile = Tile::raster (width, height);
      ASSERT_TRUE (tile.ok ());
      for (const Offset phase : {Offset{}, Offset{1, 0}, Offset{5, 3}}) {
        const auto cell = tile->cell (phase);
        ASSERT_TRUE (cell.ok ());
        ASSERT_EQ (*cell, (Extent{width, height})) << tile->name ();
        ASSERT_TRUE (tiles_by (*tile, phase, *cell)) << tile->name ();
      }
    }
  }
}

TEST (Tile, CellOfEveryLatticeIsTheSquarestBlock)
{
  for (int n = 2; n <= 36; n++)
    for (int step = 0; step < n; step++) {
      const auto tile = Tile::lattice (n, step);
      ASSERT_TRUE (tile.ok ());
      for (const Offset phase : {Offset{}, Offset{1, 2}})
        expect_cell (*tile, phase);
    }
  for (const char *name : {"lattice:64/8", "lattice:81/9", "lattice:100/10",
           "lattice:128/24", "lattice:256/16", "lattice:256/255"})
    expect_cell (named (name), {});
}

TEST (Tile, CellsOfTheNamesInUse)
{
  EXPECT_EQ (*named ("lattice:4/2").cell (), (Extent{2, 2}));
  EXPECT_EQ (*named ("lattice:5/2").cell (), (Extent{5, 1}));
  EXPECT_EQ (*named ("lattice:9/3").cell (), (Extent{3, 3}));
  EXPECT_EQ (*named ("lattice:8/4").cell (), (Extent{4, 2}));
  EXPECT_EQ (*named ("lattice:16/4").cell (), (Extent{4, 4}));
  EXPECT_EQ (*named ("lattice:256/16").cell (), (Extent{16, 16}));
  EXPECT_EQ (*named ("diamond:13").cell (), (Extent{13, 1}));
}

TEST (Tile, CellOfEveryDiamondIsTheSquarestBlock)
{
  for (int r = 1; r <= 10; r++)
    expect_cell (
        named ("diamond:" + std::to_string (2 * r * r + 2 * r + 1)), {2, 1});
}

TEST (Tile, CellOfAWrittenMapDependsOnThePhase)
{
  const auto tile = Tile::from_labels (4, 1, {0, 1, 1, 0});
  ASSERT_TRUE (tile.ok ());
  EXPECT_EQ (*tile->cell (), (Extent{2, 1}));
  EXPECT_EQ (*tile->cell ({2, 0}), (Extent{2, 1}));
  const auto none = tile->cell ({1, 0});
  ASSERT_FALSE (none.ok ());
  EXPECT_NE (none.error ().message.find ("phase 1/0"), std::string::npos);
  EXPECT_NE (none.error ().message.find ("no cell"), std::string::npos);
}

TEST (Tile, CellOfEverySmallWrittenMapIsTheSquarestBlock)
{
  int with_cell = 0, without = 0;
  for (const Extent period :
      {Extent{8, 1}, Extent{4, 2}, Extent{2, 4}, Extent{1, 8}, Extent{3, 1},
          Extent{1, 3}, Extent{3, 2}, Extent{2, 3}}) {
    const int pixels = period.width * period.height;
    for (int bits = 1; bits < (1 << pixels) - 1; bits++) {
      std::vector<std::uint8_t> labels;
      for (int i = 0; i < pixels; i++)
        labels.push_back (std::uint8_t (bits >> i & 1));
      const auto tile = Tile::from_labels (period.width, period.height, labels);
      ASSERT_TRUE (tile.ok ());
      for (const Offset phase : {Offset{}, Offset{1, 1}}) {
        const auto cell = tile->cell (phase);
        const auto best = squarest_block (*tile, phase);
        ASSERT_EQ (cell.ok (), best.has_value ()) << bits;
        if (best) {
          EXPECT_EQ (*cell, *best) << bits;
        }
        (cell.ok () ? with_cell : without)++;
      }
    }
  }
  EXPECT_GT (with_cell, 100);
  EXPECT_GT (without, 100);
}

TEST (Tile, WrittenMapIsKept)
{
  const auto tile = Tile::from_labels (2, 2, {3, 1, 0, 2});
  ASSERT_TRUE (tile.ok ());
  EXPECT_EQ (tile->name (), "labels");
  EXPECT_FALSE (tile->is_named ());
  EXPECT_EQ (tile->label (0, 0), 3);
  EXPECT_EQ (tile->label (1, 0), 1);
  EXPECT_EQ (tile->label (0, 1), 0);
  EXPECT_EQ (tile->label (1, 1), 2);
  EXPECT_FALSE (*tile == *Tile::raster (2, 2));
}

TEST (Tile, WrongMapsAreNamed)
{
  const auto expect_words = [] (const Result<Tile> &tile,
                                std::vector<std::string> words) {
    ASSERT_FALSE (tile.ok ());
    for (const std::string &word : words)
      EXPECT_NE (tile.error ().message.find (word), std::string::npos)
          << "'" << word << "' in: " << tile.error ().message;
  };
  expect_words (Tile::from_labels (0, 2, {}), {"0 x 2", "1..256"});
  expect_words (Tile::from_labels (257, 1, {}), {"257 x 1", "1..256"});
  expect_words (Tile::from_labels (2, 2, {0, 1, 2}), {"2 x 2", "4", "not 3"});
  expect_words (Tile::from_labels (2, 1, {0, 2}), {"lacks label 1", "0..1"});
  expect_words (Tile::from_labels (2, 1, {0, 0}), {"1 elements", "2 to 256"});
  expect_words (Tile::raster (16, 17), {"16x17", "2 to 256"});
  expect_words (Tile::raster (-2, -2), {"-2x-2", "2 to 256"});
  expect_words (Tile::lattice (1, 0), {"lattice:1/0", "2 to 256"});
  expect_words (Tile::lattice (5, 5), {"lattice:5/5", "step 5", "0..4"});
  expect_words (Tile::lattice (5, -1), {"step -1", "0..4"});
  expect_words (Tile::diamond (6), {"diamond:6", "5, 13, 25"});
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Mirrors of orthogonal and diamond arrays, their groups, and schedules on
 * them. */
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include <gtest/gtest.h>

#include "diamond.h"
#include "mirrors.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

constexpr Extent kSmallDiamond{12, 24};

double
distance (Position a, Position b)
{
  return std::hypot (a.x - b.x, a.y - b.y);
}

/** Mirrors of one 2x2 group of the tile laid in @p layout, by the pixel of the
 * group's corner. */
std::map<std::pair<int, int>, std::vector<Offset>>
groups_of (MirrorLayout layout)
{
  std::map<std::pair<int, int>, std::vector<Offset>> groups;
  for (int row = 0; row < kSmallDiamond.height; row++)
    for (int column = 0; column < kSmallDiamond.width; column++) {
      const Offset pixel = tile_pixel (layout, column, row);
      groups[{pixel.x - floor_mod (pixel.x, 2),
                 pixel.y - floor_mod (pixel.y, 2)}]
          .push_back ({column, row});
    }
  return groups;
}

Position
diamond_position (Offset address)
{
  return mirror_position (Array::diamond, address.x, address.y);
}

Schedule
parsed (const char *preset)
{
  const auto schedule = Schedule::parse (preset);
  EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
  return *schedule;
}

} // namespace

TEST (MirrorPosition, RowsOfADiamondLieHalfAColumnApartAndAreShifted)
{
  const Position even = mirror_position (Array::diamond, 3, 4);
  EXPECT_EQ (even.x, 3.0);
  EXPECT_EQ (even.y, 2.0);
  const Position odd = mirror_position (Array::diamond, 3, 5);
  EXPECT_EQ (odd.x, 3.5);
  EXPECT_EQ (odd.y, 2.5);
  EXPECT_EQ (mirror_position (Array::diamond, 3, 5, -0.5).x, 2.5);
  EXPECT_EQ (mirror_position (Array::orthogonal, 3, 5).x, 3.0);
  EXPECT_EQ (mirror_position (Array::orthogonal, 3, 5).y, 5.0);
}

TEST (Lattice, IsTheDocumentsFormulaAndItsInverse)
{
  for (int row = 0; row < 20; row++)
    for (int column = 0; column < 20; column++) {
      const Offset point = lattice_of (column, row);
      EXPECT_EQ (point.x, column + int (std::ceil (row / 2.0)));
      EXPECT_EQ (point.y, column - int (std::floor (row / 2.0)));
      EXPECT_EQ (address_of (point), (Offset{column, row}));
      const Position at = diamond_position ({column, row});
      EXPECT_EQ (at.x, (point.x + point.y) / 2.0);
      EXPECT_EQ (at.y, (point.x - point.y) / 2.0);
    }
}

TEST (Lattice, OddRowsMayBeShiftedToTheLeft)
{
  for (int row = 0; row < 20; row++)
    for (int column = 0; column < 20; column++) {
      const Offset point = lattice_of (column, row, true);
      EXPECT_EQ (address_of (point, true), (Offset{column, row}));
      const Position at = mirror_position (Array::diamond, column, row, -0.5);
      EXPECT_EQ (at.x, (point.x + point.y) / 2.0);
      EXPECT_EQ (at.y, (point.x - point.y) / 2.0);
      EXPECT_EQ (tile_pixel (MirrorLayout::lattice, column, row, true),
          (Offset{point.x, point.y}));
    }
}

TEST (Lattice, NeighboursShareAnEdge)
{
  const double edge = std::sqrt (0.5);
  for (const Offset address : {Offset{5, 8}, Offset{5, 9}}) {
    const Offset at = lattice_of (address.x, address.y);
    for (const Offset next : {Offset{at.x + 1, at.y}, Offset{at.x - 1, at.y},
             Offset{at.x, at.y + 1}, Offset{at.x, at.y - 1}})
      EXPECT_DOUBLE_EQ (distance (diamond_position (address),
                            diamond_position (address_of (next))),
          edge);
  }
}

TEST (GroupsOnADiamond, AddressBlocksAreParallelograms)
{
  const auto groups = groups_of (MirrorLayout::address);
  EXPECT_EQ (groups.size (), std::size_t (12 / 2 * 24 / 2));
  const auto &group = groups.at ({2, 4});
  EXPECT_EQ (group, (std::vector<Offset>{{2, 4}, {3, 4}, {2, 5}, {3, 5}}));
  double x = 0, y = 0;
  for (const Offset address : group) {
    x += diamond_position (address).x / 4;
    y += diamond_position (address).y / 4;
  }
  EXPECT_DOUBLE_EQ (x - 2, 0.75);
  EXPECT_DOUBLE_EQ (y - 2, 0.25);
}

TEST (GroupsOnADiamond, LatticeBlocksAreSquaresOfFourNeighbours)
{
  int whole = 0;
  for (const auto &[corner, group] : groups_of (MirrorLayout::lattice)) {
    if (group.size () != 4)
      continue; // cut by the border
    whole++;
    std::multiset<double> distances;
    std::map<int, int> mirrors_in_row;
    for (const Offset a : group) {
      mirrors_in_row[a.y]++;
      for (const Offset b : group)
        distances.insert (
            distance (diamond_position (a), diamond_position (b)));
    }
    EXPECT_EQ (distances.count (0.0), 4u);
    EXPECT_EQ (distances.count (std::sqrt (0.5)), 8u) << "four edges";
    EXPECT_EQ (distances.count (1.0), 4u) << "two diagonals";
    ASSERT_EQ (mirrors_in_row.size (), 3u);
    EXPECT_EQ (std::next (mirrors_in_row.begin ())->second, 2);
  }
  EXPECT_GT (whole, 40);
}

TEST (GroupsOnADiamond, CellsAreFourRowsOfTwoMirrors)
{
  const auto groups = groups_of (MirrorLayout::cell);
  EXPECT_EQ (groups.size (), std::size_t (12 / 2 * 24 / 4));
  for (const auto &[corner, group] : groups) {
    ASSERT_EQ (group.size (), 8u);
    std::map<std::pair<int, int>, int> per_label;
    for (const Offset address : group) {
      const Offset pixel =
          tile_pixel (MirrorLayout::cell, address.x, address.y);
      per_label[{floor_mod (pixel.x, 2), floor_mod (pixel.y, 2)}]++;
      EXPECT_EQ (address.x / 2, group.front ().x / 2);
      EXPECT_EQ (address.y / 4, group.front ().y / 4);
    }
    EXPECT_EQ (per_label.size (), 4u);
    for (const auto &[label, mirrors] : per_label)
      EXPECT_EQ (mirrors, 2);
  }
}

TEST (Placement, RegionsAreReadAndChecked)
{
  EXPECT_EQ (*parse_region ("768x576+576+252"), (Rect{576, 252, 768, 576}));
  EXPECT_EQ (*parse_region ("8x4"), (Rect{0, 0, 8, 4}));
  for (const char *wrong :
      {"", "8", "8x", "x8", "0x4", "8x4+1", "8x4+1+-1", "8x4+1+1+1", "8x4 "})
    EXPECT_FALSE (parse_region (wrong).ok ()) << wrong;

  const auto check = [] (const char *region, Array array) {
    return check_placement (
        {MirrorLayout::address, *parse_region (region)}, array, {912, 1140});
  };
  EXPECT_TRUE (check ("912x1140", Array::diamond).ok ());
  EXPECT_FALSE (check ("912x1140+0+2", Array::diamond).ok ());
  EXPECT_FALSE (check ("913x10", Array::diamond).ok ());
  EXPECT_FALSE (check ("10x10+0+1", Array::diamond).ok ());
  EXPECT_TRUE (check ("10x10+0+1", Array::orthogonal).ok ());
  EXPECT_FALSE (
      check_placement ({MirrorLayout::cell, {}}, Array::orthogonal, {8, 8})
          .ok ());
  for (const Rect &beyond : {Rect{-2, 0, 4, 4}, {0, -2, 4, 4}, {0, 0, 0, 4}})
    EXPECT_FALSE (check_placement (
        {MirrorLayout::address, beyond}, Array::orthogonal, {8, 8})
                      .ok ());
}

class RenderedMirrors : public ::testing::TestWithParam<const char *>
{
};

TEST_P (RenderedMirrors, AreTheSchedulesMaskMirrorByMirror)
{
  const Schedule schedule = parsed (GetParam ());
  for (const MirrorLayout layout :
      {MirrorLayout::address, MirrorLayout::lattice, MirrorLayout::cell})
    for (const bool odd_rows_left : {false, true})
      for (const auto region : {std::optional<Rect> (), {Rect{6, 4, 30, 20}}}) {
        const Placement placement{layout, region, odd_rows_left};
        const MaskRenderer renderer (schedule, {40, 30}, placement);
        Image<std::uint8_t> expected (40, 30);
        for (int mask = 0; mask < schedule.masks (); mask++) {
          expected_mask (schedule, mask, expected.view (), placement);
          EXPECT_EQ (renderer.render (mask).image (), expected)
              << layout_text (layout) << " " << mask;
        }
      }
}

TEST_P (RenderedMirrors, ComeBackFromTheirPlanes)
{
  const Schedule schedule = parsed (GetParam ());
  for (const MirrorLayout layout :
      {MirrorLayout::address, MirrorLayout::lattice, MirrorLayout::cell}) {
    const Placement placement{layout, Rect{6, 4, 30, 20}};
    const PlanePlan plan = plan_planes (schedule);
    ASSERT_EQ (int (plan.masks.size ()), schedule.masks ());
    EXPECT_EQ (plan.images, (schedule.masks () + 23) / 24);
    std::vector<PlaneImage> images;
    for (int image = 0; image < plan.images; image++)
      images.push_back (
          rendered_planes (schedule, plan, image, {40, 30}, placement)
              .image ());
    Image<std::uint8_t> mirrors (40, 30), plane (40, 30);
    for (int mask = 0; mask < schedule.masks (); mask++) {
      const PlaneSlot slot = plan.masks[std::size_t (mask)];
      expected_mask (schedule, mask, mirrors.view (), placement);
      for (int y = 0; y < 30; y++)
        for (int x = 0; x < 40; x++)
          plane.at (x, y) =
              images[std::size_t (slot.image)].at (x, y) >> slot.plane & 1;
      ASSERT_EQ (plane, mirrors) << layout_text (layout) << " " << mask;
    }
  }
}

INSTANTIATE_TEST_SUITE_P (OfSchedules, RenderedMirrors,
    ::testing::Values ("sequential:2x2", "staircase:2x2,pilot=4",
        "sequential:lattice:8/3,order=bit-reversal", "s-matrix:7x1",
        "sequential:6x5,phase=3/1", "sequential:diamond:13",
        "staircase:3x2,phase=2/1", "sequential:4x4,pilot=4",
        "sequential:2x2,pilot=6,region=9x8+3+17:staircase:3x2",
        "sequential:2x2,pilot=4,region=8x6+6+4:sequential:4x2,region=6x4+20+9:"
        "staircase:3x2"));

TEST (RenderedMirrors, ThePilotHasTheRowsOfTheTile)
{
  const Schedule schedule = parsed ("sequential:2x2,pilot=4");
  EXPECT_EQ (pilot_top (schedule, MirrorLayout::address, 40), 36);
  EXPECT_EQ (pilot_top (schedule, MirrorLayout::cell, 40), 32);
}

TEST (PlaneOrder, KeepsMasksOfNeighbouringRowsInOneImage)
{
  // 64 masks in 3 images: in the order of slots, a bit-reversed schedule would
  // light all 8 rows of the tile in each of them.
  const Schedule schedule = parsed ("sequential:8x8,order=bit-reversal");
  const PlanePlan plan = plan_planes (schedule);
  ASSERT_EQ (plan.images, 3);
  for (int index = 0; index < plan.images; index++) {
    const PlaneImage image =
        rendered_planes (schedule, plan, index, {64, 64}).image ();
    int lit_rows = 0;
    for (int y = 0; y < 8; y++)
      lit_rows += image.at (0, y) != 0;
    EXPECT_LE (lit_rows, 3);
  }
}

TEST (MaskDigest, IsThatOfTheMirrors)
{
  // The masks of a raster that starts one pixel later are those of the raster.
  const Schedule raster = parsed ("sequential:2x2");
  const Schedule shifted = parsed ("sequential:2x2,phase=1/0");
  EXPECT_EQ (digest_mask (raster, 0), digest_mask (shifted, 1));
  EXPECT_NE (digest_mask (raster, 0), digest_mask (shifted, 0));
  const Schedule pilot = parsed ("sequential:2x2,pilot=8");
  EXPECT_NE (digest_mask (raster, 0), digest_mask (pilot, 0));
  EXPECT_NE (digest_mask (pilot, 0), digest_mask (pilot, 4));
}

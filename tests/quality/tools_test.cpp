/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Tests of metrics, tables, scenes and interpolation. */
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "metrics.h"
#include "scene.h"
#include "schedule/sample_grid.h"
#include "table.h"
#include "upsample.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::quality;

Picture
picture_of (int width, int height, std::initializer_list<int> values)
{
  Picture picture (width, height);
  int i = 0;
  for (const int value : values) {
    picture.at (i % width, i / width) = std::uint8_t (value);
    i++;
  }
  return picture;
}

TEST (PooledError, PsnrIsOfTheMeanOverEverythingAdded)
{
  PooledError error;
  error.add (100.0, 90.0);
  for (int i = 0; i < 3; i++)
    error.add (50.0, 50.0);
  EXPECT_NEAR (error.psnr (), 10.0 * std::log10 (255.0 * 255.0 / 25.0), 1e-12);
}

TEST (PooledError, SumsPoolToo)
{
  PooledError one, other;
  one.add (100.0, 90.0);
  for (int i = 0; i < 3; i++)
    other.add (50.0, 50.0);
  one += other;
  EXPECT_NEAR (one.psnr (), 10.0 * std::log10 (255.0 * 255.0 / 25.0), 1e-12);
}

TEST (PooledError, NoErrorIsInfinite)
{
  PooledError error;
  error.add (7.0, 7.0);
  EXPECT_TRUE (std::isinf (error.psnr ()));
}

TEST (Metrics, MeanDeviationAndEntropy)
{
  const Picture even = picture_of (4, 1, {0, 2, 4, 6});
  EXPECT_DOUBLE_EQ (mean_of (even.view ()), 3.0);
  EXPECT_DOUBLE_EQ (deviation_of (even.view ()), std::sqrt (5.0));
  EXPECT_DOUBLE_EQ (entropy_of (even.view ()), 2.0);
  EXPECT_DOUBLE_EQ (entropy_of (picture_of (2, 2, {9, 9, 9, 9}).view ()), 0.0);
  EXPECT_DOUBLE_EQ (entropy_of (picture_of (4, 1, {1, 1, 1, 255}).view ()),
      0.75 * std::log2 (4.0 / 3.0) + 0.25 * 2.0);
}

Table
small_table ()
{
  return {"small", "A small table", {{"name"}, {"number", 2}},
      {{"one", 1.0}, {"none", std::numeric_limits<double>::quiet_NaN ()},
          {"all", std::numeric_limits<double>::infinity ()}}};
}

TEST (Table, TextIsAligned)
{
  EXPECT_EQ (to_text (small_table ()), "A small table\n"
                                       "  name  number\n"
                                       "  one     1.00\n"
                                       "  none       -\n"
                                       "  all    exact\n");
}

TEST (Table, JsonKeepsNumbers)
{
  EXPECT_NE (
      to_json ({small_table ()}).find ("\"number\": 1.0"), std::string::npos);
  EXPECT_NE (to_json ({small_table ()}).find ("\"number\": \"exact\""),
      std::string::npos);
}

TEST (Table, CellsComeBackFromTheDocumentTheyWereWrittenTo)
{
  const std::string document = "Before.\n<!-- table small -->\nold\n"
                               "<!-- end -->\nAfter.\n";
  const auto written = with_tables (document, {small_table ()});
  ASSERT_TRUE (written);
  EXPECT_EQ (written->find ("old"), std::string::npos);
  EXPECT_EQ (written->substr (0, 8), "Before.\n");
  EXPECT_EQ (written->substr (written->size () - 7), "After.\n");
  const std::vector<std::vector<std::string>> cells = {
      {"one", "1.00"}, {"none", "-"}, {"all", "exact"}};
  EXPECT_EQ (table_cells (*written, "small"), cells);
  EXPECT_EQ (*with_tables (*written, {small_table ()}), *written);
}

TEST (Table, DocumentWithoutAPlaceIsAnError)
{
  const auto written = with_tables ("<!-- end -->\n", {small_table ()});
  ASSERT_FALSE (written);
  EXPECT_NE (written.error ().message.find ("<!-- table small -->"),
      std::string::npos);
}

TEST (Scene, BarMovesThreePixelsASlot)
{
  const Scene scene = synthetic_scene (200, 80, 2);
  ASSERT_EQ (scene.frames.size (), 2u);
  for (int x = 30; x < 60; x++) {
    const bool bar = std::abs (x - 40) < 6;
    EXPECT_EQ (scene.frames[0].at (x, 70) == 235, bar) << x;
    EXPECT_EQ (scene.frames[1].at (x + 3, 70) == 235, bar) << x;
  }
}

TEST (Scene, StillSceneStandsStill)
{
  const Picture picture = picture_of (2, 1, {3, 4});
  const Scene scene = still_scene ("still", picture, 3);
  ASSERT_EQ (scene.frames.size (), 3u);
  for (const Picture &frame : scene.frames)
    EXPECT_EQ (frame, picture);
}

/* Subframe of a plane, which linear interpolation must give back exactly. */
void
expect_plane_restored (const std::string &preset)
{
  SCOPED_TRACE (preset);
  const auto plane = [] (double x, double y) {
    return 3.0 + 0.5 * x - 0.25 * y;
  };
  const auto schedule = Schedule::from_preset (preset);
  ASSERT_TRUE (schedule);
  const SampleGrid grid (*schedule);
  const Extent cell = grid.cell ();
  const Extent size = grid.subframe_size (64, 48);
  for (int e = 0; e < grid.elements (); e++) {
    Image<float> subframe (size.width, size.height);
    for (int j = 0; j < size.height; j++) {
      for (int i = 0; i < size.width; i++) {
        const Offset at = grid.offset (e, i, j);
        subframe.at (i, j) =
            float (plane (i * cell.width + at.x, j * cell.height + at.y));
      }
    }
    const Upsampler upsampler (*schedule, e, false);
    const int border = upsampler.margin ();
    ASSERT_LT (border, 20);
    for (int y = border; y < 48 - border; y++) {
      for (int x = border; x < 64 - border; x++)
        ASSERT_NEAR (upsampler.at (subframe.view (), x, y), plane (x, y), 1e-4)
            << e << " " << x << "," << y;
    }
  }
}

TEST (Upsampler, RestoresAPlaneOnEveryTile)
{
  for (const char *preset : {"sequential:2x2", "sequential:4x2",
           "sequential:3x3", "sequential:lattice:4/2", "sequential:lattice:5/2",
           "sequential:lattice:8/3,order=bit-reversal"})
    expect_plane_restored (preset);
}

TEST (Upsampler, CentredSamplesStandInTheMiddleOfTheCell)
{
  Image<float> subframe (8, 8);
  for (int j = 0; j < 8; j++) {
    for (int i = 0; i < 8; i++)
      subframe.at (i, j) = float (2 * i) + 0.5f;
  }
  const Upsampler upsampler (Schedule (), 0, true);
  EXPECT_DOUBLE_EQ (upsampler.at (subframe.view (), 6, 6), 6.0);
  EXPECT_DOUBLE_EQ (upsampler.at (subframe.view (), 7, 6), 7.0);
}

} // namespace

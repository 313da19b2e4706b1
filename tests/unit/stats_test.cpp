/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The figures of pictures, and lines across them. */
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "stats/event_watch.h"
#include "stats/picture_stats.h"

namespace
{

using namespace codedexposure;
using Points = std::vector<Position>;

template <typename Pixel>
Image<Pixel>
picture_of (int width, std::vector<Pixel> pixels)
{
  Image<Pixel> picture (width, int (pixels.size ()) / width);
  for (int y = 0; y < picture.height (); y++)
    for (int x = 0; x < width; x++)
      picture.at (x, y) = pixels[std::size_t (y * width + x)];
  return picture;
}

template <typename Pixel>
PictureStats
stats_of (const Image<Pixel> &picture, const StatsOptions &options = {})
{
  auto meter = StatsMeter::make (
      {picture.width (), picture.height ()}, 8 * int (sizeof (Pixel)), options);
  EXPECT_TRUE (meter) << meter.error ().message;
  return meter->measure (picture.view ());
}

ProfileLine
line_of (const char *text)
{
  const auto line = ProfileLine::parse (text);
  EXPECT_TRUE (line) << line.error ().message;
  return *line;
}

Points
points_of (const char *text, Extent size)
{
  const auto points = line_of (text).points (size);
  EXPECT_TRUE (points) << points.error ().message;
  return *points;
}

std::string
complaint_about (const char *line, Extent size)
{
  const auto points = line_of (line).points (size);
  return points ? "" : points.error ().message;
}

TEST (Stats, OfFewPixels)
{
  const auto stats = stats_of (
      picture_of<std::uint8_t> (5, {3, 3, 9, 255, 255, 3, 9, 9, 255, //
                                       4}));
  EXPECT_EQ (stats.pixels, 10u);
  EXPECT_DOUBLE_EQ (stats.mean, (9.0 + 27 + 765 + 4) / 10);
  EXPECT_EQ (stats.minimum, 3u);
  EXPECT_EQ (stats.maximum, 255u);
  EXPECT_EQ (stats.saturated, 3u);
  /* -3 (0.3 log2 0.3) - 0.1 log2 0.1 */
  EXPECT_NEAR (stats.entropy, 1.8954618442383218, 1e-12);
  ASSERT_EQ (stats.histogram.size (), 256u);
  EXPECT_EQ (stats.histogram[3], 3u);
  EXPECT_EQ (stats.histogram[4], 1u);
  EXPECT_EQ (stats.histogram[255], 3u);
  EXPECT_TRUE (stats.profile.empty ());
}

TEST (Stats, EveryLevelOnceIsEightBits)
{
  Image<std::uint8_t> picture (16, 16);
  std::iota (picture.view ().data, picture.view ().data + 256, 0);
  const auto stats = stats_of (picture, {.bins = 4});
  EXPECT_DOUBLE_EQ (stats.mean, 127.5);
  EXPECT_DOUBLE_EQ (stats.entropy, 8.0);
  EXPECT_EQ (stats.histogram, std::vector<std::uint64_t> (4, 64));
}

TEST (Stats, AFlatPictureHasNoEntropy)
{
  for (int width = 1; width < 9; width++) {
    Image<std::uint16_t> picture (width, 3);
    std::fill_n (picture.view ().data, 3 * width, std::uint16_t (700));
    const auto stats = stats_of (picture);
    EXPECT_EQ (stats.mean, 700.0);
    EXPECT_EQ (stats.minimum, 700u);
    EXPECT_EQ (stats.maximum, 700u);
    EXPECT_EQ (stats.entropy, 0.0);
  }
}

TEST (Stats, TwelveBitsOfSixteen)
{
  const auto picture =
      picture_of<std::uint16_t> (3, {0, 15, 16, 4094, 4095, 5000});
  const auto stats = stats_of (picture, {.bits = 12, .bins = 256});
  EXPECT_EQ (stats.saturated, 2u) << "4095, and what should not be there";
  EXPECT_EQ (stats.maximum, 5000u);
  EXPECT_EQ (stats.histogram[0], 2u);
  EXPECT_EQ (stats.histogram[1], 1u);
  EXPECT_EQ (stats.histogram[255], 3u);
  EXPECT_EQ (stats_of (picture).saturated, 0u) << "of all 16 bits";
}

TEST (Stats, MeasureStartsAnewAndHeedsTheStride)
{
  std::vector<std::uint8_t> memory (3 * 16, 200);
  const ImageView<std::uint8_t> picture{memory.data (), 7, 3, 16};
  auto meter = StatsMeter::make ({7, 3}, 8, {});
  ASSERT_TRUE (meter);
  for (std::uint8_t value : {10, 20}) {
    for (int y = 0; y < 3; y++)
      std::fill_n (picture.row (y), 7, value);
    const PictureStats &stats = meter->measure<std::uint8_t> (picture);
    EXPECT_EQ (stats.mean, value);
    EXPECT_EQ (stats.minimum, value);
    EXPECT_EQ (stats.maximum, value);
    EXPECT_EQ (stats.histogram[value], 21u);
  }
}

TEST (Stats, ProfilesAreThePixelsOfALine)
{
  const auto picture =
      picture_of<std::uint8_t> (3, {1, 2, 3, 11, 12, 13, 21, 22, 23});
  const auto profile = [&] (const char *line) {
    return stats_of (picture, {.line = line_of (line)}).profile;
  };
  EXPECT_EQ (profile ("row:1"), (std::vector<double>{11, 12, 13}));
  EXPECT_EQ (profile ("row:100%"), (std::vector<double>{21, 22, 23}));
  EXPECT_EQ (profile ("column:2"), (std::vector<double>{3, 13, 23}));
  EXPECT_EQ (profile ("2/2/0/2"), (std::vector<double>{23, 22, 21}));
  EXPECT_EQ (profile ("0.5/0/0.5/2"), (std::vector<double>{1.5, 11.5, 21.5}));
  EXPECT_EQ (profile ("0/0/100%/50%"), (std::vector<double>{1, 7, 13}));
}

TEST (Stats, RefusesWhatItCannotMeasure)
{
  const auto complaint = [] (Extent size, const StatsOptions &options) {
    const auto meter = StatsMeter::make (size, 8, options);
    return meter ? "" : meter.error ().message;
  };
  EXPECT_EQ (complaint ({4, 4}, {}), "");
  EXPECT_EQ (complaint ({0, 4}, {}), "a picture of 0x4 has no statistics");
  EXPECT_EQ (complaint ({4, 4}, {.bits = 9}),
      "bits = 9 is out of range; a pixel has 1 to 8, 0 means all");
  EXPECT_EQ (complaint ({4, 4}, {.bins = -1}),
      "a histogram cannot have -1 bins; 0 leaves it out");
  EXPECT_NE (complaint ({4, 4}, {.line = line_of ("row:4")}), "");
}

TEST (ProfileLine, PointsArePixels)
{
  EXPECT_EQ (points_of ("row:2", {3, 4}), (Points{{0, 2}, {1, 2}, {2, 2}}));
  EXPECT_EQ (points_of ("row:50%", {2, 4}), (Points{{0, 2}, {1, 2}}));
  EXPECT_EQ (points_of ("column:0%", {3, 2}), (Points{{0, 0}, {0, 1}}));
  EXPECT_EQ (points_of ("1/1/3.5/4.5", {9, 9}),
      (Points{
          {1, 1}, {1.625, 1.875}, {2.25, 2.75}, {2.875, 3.625}, {3.5, 4.5}}));
  EXPECT_EQ (points_of ("1/1/1/1", {9, 9}), (Points{{1, 1}}));
  EXPECT_EQ (points_of ("row:0", {1, 1}), (Points{{0, 0}}));
}

TEST (ProfileLine, SaysWhereItLeavesThePicture)
{
  EXPECT_EQ (complaint_about ("row:288", {384, 288}),
      "the line reaches pixel (383, 288) of a picture of 384x288; its last "
      "pixel is (383, 287); percentages such as 50% fit every size");
  EXPECT_EQ (complaint_about ("row:287", {384, 288}), "");
  EXPECT_EQ (complaint_about ("0/0/100%/100%", {384, 288}), "");
  EXPECT_NE (complaint_about ("400/0/0/0", {384, 288}), "");
}

TEST (ProfileLine, RefusesWhatIsNoLine)
{
  for (const char *text : {"", "row:", "row:1/2", "row:-1", "row:101%",
           "column:x", "1/2/3", "1/2/3/4/5", "1/2/3/nan", "rows:1", "row:1e9"})
    EXPECT_FALSE (ProfileLine::parse (text)) << text;
  EXPECT_EQ (ProfileLine::parse ("line").error ().message,
      "'line' is not a line; use row:Y, column:X or X0/Y0/X1/Y1, in pixels or "
      "in %");
  EXPECT_EQ (ProfileLine::parse ("row:120%").error ().message,
      "'120%' is not a coordinate; use pixels, such as 143, or a percentage, "
      "0% to 100%");
}

TEST (EventRules, AreRead)
{
  const auto mean = parse_event_rule ("mean:12.5");
  ASSERT_TRUE (mean);
  EXPECT_EQ (mean->kind, EventRule::Kind::mean);
  EXPECT_EQ (mean->part, 0.125);
  EXPECT_FALSE (mean->region);
  const auto motion = parse_event_rule ("motion:2@64x48+100+80");
  ASSERT_TRUE (motion);
  EXPECT_EQ (motion->kind, EventRule::Kind::motion);
  EXPECT_EQ (motion->region, (Rect{100, 80, 64, 48}));
  for (const char *text : {"", "mean", "mean:", "mean:0", "mean:101", "mean:-3",
           "mean:nan", "light:10", "mean:10@", "mean:10@64", "mean:10@0x4+1+1",
           "mean:10@4x4+-1+1", "motion:2 "})
    EXPECT_FALSE (parse_event_rule (text)) << text;
}

/* Pictures of one value, but for a few pixels that have twice of it. */
template <typename Pixel>
Image<Pixel>
event_picture (int value, int place)
{
  Image<Pixel> picture (8, 8);
  for (int y = 0; y < 8; y++)
    for (int x = 0; x < 8; x++)
      picture.at (x, y) = Pixel (value * (y == 0 && x == place ? 2 : 1));
  return picture;
}

template <typename Pixel>
class EventsOf : public testing::Test
{
};
using PixelTypes = testing::Types<std::uint8_t, std::uint16_t>;
TYPED_TEST_SUITE (EventsOf, PixelTypes);

TYPED_TEST (EventsOf, MeanAreJumpsAndNoDrift)
{
  EventWatch watch ({EventRule::Kind::mean, 0.05, {}});
  const auto add = [&] (int value) {
    return watch.add (event_picture<TypeParam> (value, 8).view (), 200);
  };
  for (int k = 0; k < 80; k++)
    EXPECT_FALSE (add (20 + k / 2)) << k;
  const auto jump = add (120);
  ASSERT_TRUE (jump);
  EXPECT_NEAR (*jump, (120 - 53) / 200.0, 0.01);
  for (int k = 0; k < 10; k++) // usual now
    EXPECT_FALSE (add (120)) << k;
  EXPECT_TRUE (add (20)); // down
}

TYPED_TEST (EventsOf, MotionIsNoBrightness)
{
  EventWatch watch ({EventRule::Kind::motion, 0.002, {}});
  const auto add = [&] (int place) {
    return watch.add (event_picture<TypeParam> (100, place).view (), 200);
  };
  for (int k = 0; k < 20; k++)
    EXPECT_FALSE (add (3)) << k;
  const auto jump = add (4); // two pixels of 64 differ by 100
  ASSERT_TRUE (jump);
  EXPECT_NEAR (*jump, 2 * 100 / 64.0 / 200, 1e-9);
  for (int k = 0; k < 10; k++)
    EXPECT_FALSE (add (4)) << k;
  watch.skip ();
  EXPECT_FALSE (add (6)); // what came between is not known
  EXPECT_TRUE (add (7));
}

TYPED_TEST (EventsOf, RegionHasItsOwnPixels)
{
  EventWatch watch ({EventRule::Kind::motion, 0.002, Rect{0, 1, 8, 7}});
  for (int k = 0; k < 40; k++)
    EXPECT_FALSE (
        watch.add (event_picture<TypeParam> (100, k % 8).view (), 200));
  EXPECT_TRUE (watch.fits ({8, 8}));
  EXPECT_FALSE (watch.fits ({8, 7}));
  EXPECT_FALSE (watch.add (Image<TypeParam> (8, 7).view (), 200));
}

} // namespace

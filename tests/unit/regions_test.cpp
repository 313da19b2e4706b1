/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Schedules with regions: valid ones, the states of mirrors, and the pictures
 * of each part. */
#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bench/bench.h"
#include "dmd/dmd.h"
#include "extract/extractor.h"
#include "fuse/fuser.h"
#include "mirrors.h"
#include "schedule/sample_grid.h"
#include "schedule/schedule.h"
#include "sync/phase_watch.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

constexpr const char *kTwo = "sequential:2x2,"
                             "region=16x8+8+4:sequential:4x2,"
                             "region=6x6+30+10:staircase:3x2:phase=1/1";

Schedule
preset (const std::string &text)
{
  const auto schedule = Schedule::from_preset (text);
  EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
  return schedule.ok () ? *schedule : Schedule ();
}

Schedule
json (const std::string &regions)
{
  const auto schedule = Schedule::from_json (
      R"({"format":"coded-exposure","version":1,"tile":"2x2",)"
      R"("code":"sequential","regions":)" +
      regions + "}");
  EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
  return schedule.ok () ? *schedule : Schedule ();
}

void
expect_words (const Result<Schedule> &schedule, const std::string &what,
    const std::vector<std::string> &words)
{
  ASSERT_FALSE (schedule.ok ()) << what << " was taken";
  for (const std::string &word : words)
    EXPECT_NE (schedule.error ().message.find (word), std::string::npos)
        << what << ": " << schedule.error ().message << "\nlacks: " << word;
}

/** A scene that changes with every slot of the exposure. */
std::uint8_t
light (int x, int y, int slot)
{
  return std::uint8_t (x * 31 + y * 57 + slot * 101 + x * y * slot);
}

Image<std::uint8_t>
coded_frame (const Schedule &schedule, int width, int height,
    std::uint8_t (*scene) (int, int, int))
{
  auto bench = OpticalBench::make (width, height, {});
  Image<std::uint8_t> image (width, height), coded (width, height);
  bench->begin (schedule);
  for (int slot = 0; slot < schedule.slots (); slot++) {
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++)
        image.at (x, y) = scene (x, y, slot);
    bench->expose (image.view (), slot, 1.0);
  }
  bench->read_out (0, coded.view ());
  return coded;
}

std::vector<Image<std::uint8_t>>
extract (const Schedule &part, ImageView<const std::uint8_t> coded,
    const ExtractOptions &options = {})
{
  const auto extractor =
      Extractor<std::uint8_t>::make (part, coded.width, coded.height, options);
  EXPECT_TRUE (extractor.ok ()) << extractor.error ().message;
  const Extent size = extractor->subframe_size ();
  std::vector<Image<std::uint8_t>> subframes (
      std::size_t (extractor->subframes ()),
      Image<std::uint8_t> (size.width, size.height));
  std::vector<ImageView<std::uint8_t>> views;
  for (auto &subframe : subframes)
    views.push_back (subframe.view ());
  EXPECT_TRUE (extractor->run (coded, views));
  return subframes;
}

ImageView<const std::uint8_t>
pixels_of (const Rect &rect, const Image<std::uint8_t> &coded)
{
  return coded.view ().block (rect.x, rect.y, rect.width, rect.height);
}

} // namespace

TEST (Regions, ShareAnExposureOfTheLeastCommonMultiple)
{
  const Schedule schedule = preset (kTwo);
  EXPECT_EQ (schedule.elements (), 4);
  EXPECT_EQ (schedule.slots (), 24); // of 4, 8 and 6
  EXPECT_EQ (schedule.masks (), 24);
  EXPECT_EQ (schedule.region (0).slots (), 8);
  EXPECT_EQ (schedule.region (1).slots (), 6);
  EXPECT_EQ (schedule.background ().text (), "sequential:2x2");
  EXPECT_EQ (schedule.background ().slots (), 4);
  EXPECT_EQ (preset ("sequential:2x2,leak=0.01,pilot=16,region=2x2+0+0:"
                     "sequential:2x1")
                 .region (0),
      preset ("sequential:2x1,leak=0.01"));
  EXPECT_EQ (preset (std::string (kTwo) + ",pilot=4").masks (), 48);
}

TEST (Regions, KnowTheWhiteOfTheWhole)
{
  EXPECT_EQ (preset ("sequential:2x2").white_slots (), 1.0);
  const Schedule schedule = preset ("sequential:2x2,region=8x8+0+0:sequential:"
                                    "4x2,region=8x8+8+8:sequential:2x1");
  /* 4 of 8 slots light the brightest part: that is 2 of 4, 4 of 8, 1 of 2. */
  EXPECT_EQ (schedule.white_slots (), 4.0);
  EXPECT_EQ (schedule.background ().white_slots (), 2.0);
  EXPECT_EQ (schedule.region (0).white_slots (), 4.0);
  EXPECT_EQ (schedule.region (1).white_slots (), 1.0);
  EXPECT_EQ (schedule.region (1), preset ("sequential:2x1"));
  EXPECT_FALSE (schedule.region (0) == preset ("sequential:4x2"));
  const auto method = [] (const Schedule &part) {
    return Extractor<std::uint8_t>::make (part, 8, 8)->method ();
  };
  EXPECT_EQ (method (schedule.region (1)), Method::kSelect);
  EXPECT_EQ (method (schedule.region (0)), Method::kDecode);
}

TEST (Regions, AreFoundByPlace)
{
  const Schedule schedule = preset (kTwo);
  EXPECT_EQ (schedule.region_at (8, 4), 0);
  EXPECT_EQ (schedule.region_at (23, 11), 0);
  EXPECT_EQ (schedule.region_at (24, 11), -1);
  EXPECT_EQ (schedule.region_at (23, 12), -1);
  EXPECT_EQ (schedule.region_at (7, 4), -1);
  EXPECT_EQ (schedule.region_at (30, 10), 1);
  EXPECT_EQ (schedule.region_at (-1, -1), -1);
}

TEST (Regions, HoldEachMaskAndBeginAtTheirOwnCorner)
{
  const Schedule schedule = preset (kTwo);
  for (int slot = 0; slot < 24; slot++) {
    /* n = 4 holds each mask for 6 slots, n = 8 for 3, n = 6 for 4. */
    for (int place = 0; place < 4; place++)
      EXPECT_EQ (
          schedule.on (2 + place % 2, 2 + place / 2, slot), slot / 6 == place);
    for (int place = 0; place < 8; place++)
      EXPECT_EQ (
          schedule.on (8 + place % 4, 4 + place / 4, slot), slot / 3 == place);
    /* phase 1/1: the corner bears label 4, which is open in 5 of 6. */
    EXPECT_EQ (schedule.on (30, 10, slot), slot / 4 <= 4);
  }
}

TEST (Regions, MasksOfEveryMakingAgree)
{
  const Schedule schedule = preset (std::string (kTwo) + ",pilot=3");
  constexpr int kWidth = 41, kHeight = 25;
  Image<std::uint8_t> expected (kWidth, kHeight);
  const PlanePlan plan = plan_planes (schedule);
  std::set<std::pair<std::uint64_t, std::uint64_t>> digests;
  std::set<std::vector<std::uint8_t>> different;
  for (int mask = 0; mask < schedule.masks (); mask++) {
    const Image<std::uint8_t> mirrors =
        rendered_mask (schedule, mask, {kWidth, kHeight});
    expected_mask (schedule, mask, expected.view ());
    ASSERT_EQ (mirrors, expected) << "mask " << mask;
    const PlaneSlot at = plan.masks[std::size_t (mask)];
    const PlaneImage planes =
        rendered_planes (schedule, plan, at.image, {kWidth, kHeight}).image ();
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++) {
        ASSERT_EQ (planes.at (x, y) >> at.plane & 1, mirrors.at (x, y))
            << "mask " << mask << " at " << x << ", " << y;
        if (y < kHeight - 3) {
          ASSERT_EQ (mirrors.at (x, y), schedule.on (x, y, mask % 24));
        }
      }
    const PlaneDigest digest = digest_mask (schedule, mask);
    digests.insert ({digest.high, digest.low});
    different.emplace (
        mirrors.view ().data, mirrors.view ().data + kWidth * kHeight);
  }
  EXPECT_EQ (digests.size (), different.size ());
  EXPECT_GT (different.size (), 8u);
  EXPECT_FALSE (
      digest_mask (preset ("sequential:2x2"), 0) == digest_mask (schedule, 0));
}

TEST (Regions, AreCutAtTheBordersOfSmallArrays)
{
  const Schedule schedule = preset (kTwo);
  for (int mask = 0; mask < 24; mask++) {
    const Image<std::uint8_t> mirrors = rendered_mask (schedule, mask, {12, 6});
    for (int y = 0; y < 6; y++)
      for (int x = 0; x < 12; x++)
        ASSERT_EQ (mirrors.at (x, y), schedule.on (x, y, mask));
  }
}

/* A mask that is shown for several slots also lights the pauses between them.
 */
TEST (Regions, HaveTheTimesOfTheirOwnMasks)
{
  const Schedule schedule = preset ("sequential:4x2,active=4ms,switching=1ms,"
                                    "region=8x8+0+0:sequential:2x2,"
                                    "region=8x8+8+0:staircase:2x1");
  const auto plan = [] (const Schedule &part) {
    return *SlotPlan::fit (part.timing (), part.slots (), {25, 1});
  };
  const SlotPlan whole = plan (schedule);
  for (const Schedule &part :
      {schedule.region (0), schedule.region (1), schedule.background ()}) {
    const int held = schedule.slots () / part.slots ();
    const SlotPlan own = plan (part);
    for (int slot = 0; slot < part.slots (); slot++) {
      EXPECT_EQ (own.start (slot), whole.start (slot * held));
      EXPECT_EQ (own.start (slot) + own.active (),
          whole.start (slot * held + held - 1) + whole.active ())
          << part.text ();
    }
  }
}

TEST (Regions, TextsReadBack)
{
  const char *texts[] = {kTwo,
      "staircase:2x2,active=1ms,leak=0.01,pilot=16,region=8x8+0+0:sequential:"
      "lattice:8/3:order=bit-reversal",
      "sequential:2x2,region=4x4+0+0:s-matrix:2x2:order=3/1/2/0:phase=1/0"};
  for (const char *text : texts) {
    const Schedule schedule = preset (text);
    EXPECT_EQ (preset (schedule.text ()), schedule) << schedule.text ();
    const auto again = Schedule::from_json (schedule.to_json ());
    ASSERT_TRUE (again.ok ()) << again.error ().message;
    EXPECT_EQ (*again, schedule);
  }
  EXPECT_EQ (preset (kTwo).text (), kTwo);
  EXPECT_EQ (preset ("sequential:2x2,region=8x4+2+6:sequential:4x2").to_json (),
      R"({"format":"coded-exposure","version":1,"tile":"2x2",)"
      R"("code":"sequential","regions":[{"rect":[2,6,8,4],"tile":"4x2",)"
      R"("code":"sequential"}]})");
  EXPECT_EQ (json (R"([{"rect":[2,6,8,4],"tile":"4x2","code":"sequential",)"
                   R"("order":[0,1,2,3,4,5,6,7],"phase":[0,0]}])"),
      preset ("sequential:2x2,region=8x4+2+6:sequential:4x2"));
}

TEST (Regions, WrongPresetsAreNamed)
{
  const struct {
    const char *region;
    std::vector<std::string> words;
  } cases[] = {
      {"", {"''", "WxH+X+Y:CODE:TILE"}},
      {"8x8+0+0", {"'8x8+0+0'", "with a code", "WxH+X+Y"}},
      {"8x8:sequential:2x2", {"'8x8'", "WxH+X+Y"}},
      {"8x8+0-1:sequential:2x2", {"'8x8+0-1'"}},
      {"8x8+-1+0:sequential:2x2", {"8x8+-1+0", "0..16384"}},
      {"8x8+0+16385:sequential:2x2", {"0..16384"}},
      {"0x8+0+0:sequential:2x2", {"region 0, 0x8+0+0", "no pixel"}},
      {"7x8+0+0:sequential:2x2", {"multiples", "2x2"}},
      {"8x8+0+0:sequential", {"the tile is missing"}},
      {"8x8+0+0:order=0/1", {"'' is no code"}},
      {"8x8+0+0:rolling:2x2", {"'rolling' is no code"}},
      {"8x8+0+0:sequential:2x2:leak=0.1", {"no key 'leak'", "order, phase"}},
      {"8x8+0+0:sequential:2x2:phase=0/0:x", {"'x' after a colon"}},
      {"8x8+0+0:sequential:2x2:order=0/1/2/2", {"region 0", "permutation"}},
      {"257x257+0+0:sequential:lattice:257/3", {"257 elements"}},
      {"14x14+0+0:sequential:7x1,region=22x2+20+20:sequential:11x1",
          {"region 1", "308 slots", "least common multiple", "256"}},
      {"8x8+0+0:sequential:2x2,region=8x8+7+7:sequential:2x2",
          {"region 1, 8x8+7+7", "overlaps region 0, 8x8+0+0"}},
  };
  for (const auto &c : cases)
    expect_words (Schedule::from_preset (
                      "sequential:2x2,region=" + std::string (c.region)),
        c.region, c.words);
  std::string many = "sequential:2x2";
  for (int i = 0; i < 65; i++)
    many += ",region=2x2+" + std::to_string (2 * i) + "+0:sequential:2x1";
  expect_words (Schedule::from_preset (many), "65", {"65 regions", "64"});
}

TEST (Regions, WrongJsonIsNamed)
{
  const struct {
    const char *regions;
    std::vector<std::string> words;
  } cases[] = {
      {"[]", {"'regions'", "at least one"}},
      {"{}", {"'regions'", "a list"}},
      {"[1]", {"regions[0]", "an object"}},
      {R"([{"tile":"2x2","code":"sequential"}])", {"'rect' is missing"}},
      {R"([{"rect":[0,0,2,2],"code":"sequential"}])", {"'tile' is missing"}},
      {R"([{"rect":[0,0,2,2],"tile":"2x2"}])", {"'code' is missing"}},
      {R"([{"rect":[0,0,2],"tile":"2x2","code":"sequential"}])",
          {"regions[0]", "[x, y, width, height]"}},
      {R"([{"rect":[0,-2,2,2],"tile":"2x2","code":"sequential"}])",
          {"rect[1]", "-2"}},
      {R"([{"rect":[0,0,2,2],"tile":"2x2","code":"sequential","leak":0}])",
          {"no key 'leak'", "rect"}},
      {R"([{"rect":[0,0,3,2],"tile":"2x2","code":"sequential"}])",
          {"region 0, 3x2+0+0", "multiples"}},
  };
  for (const auto &c : cases)
    expect_words (Schedule::from_json (
                      R"({"format":"coded-exposure","version":1,"tile":"2x2",)"
                      R"("code":"sequential","regions":)" +
                      std::string (c.regions) + "}"),
        c.regions, c.words);
}

TEST (Regions, LieWithinTheFrameAboveThePilot)
{
  const Schedule schedule = preset (std::string (kTwo) + ",pilot=4");
  EXPECT_TRUE (schedule.check_size (36, 20).ok ());
  const auto narrow = schedule.check_size (35, 20);
  ASSERT_FALSE (narrow.ok ());
  EXPECT_NE (
      narrow.error ().message.find ("region 1, 6x6+30+10"), std::string::npos)
      << narrow.error ().message;
  const auto low = schedule.check_size (36, 19);
  ASSERT_FALSE (low.ok ());
  EXPECT_NE (low.error ().message.find ("pilot's 4 rows"), std::string::npos);
  EXPECT_TRUE (preset ("sequential:2x2").check_size (1, 1).ok ());
}

TEST (Regions, SlipsShowInThePilotOnly)
{
  const std::string staircase = "staircase:2x2";
  const std::string region = ",region=8x8+0+0:sequential:4x2";
  EXPECT_EQ (
      slip_observable (preset (staircase)), SlipObservable::in_the_frame);
  EXPECT_EQ (
      slip_observable (preset (staircase + region)), SlipObservable::never);
  EXPECT_EQ (slip_observable (preset (staircase + ",pilot=8" + region)),
      SlipObservable::always);
}

/* Each part gives the scene at its pixels while their mirrors were on. */
TEST (Regions, PicturesOfEveryPartComeOut)
{
  const Schedule schedule =
      preset ("sequential:2x2,region=16x8+8+4:sequential:4x2,region=8x8+30+8:"
              "sequential:2x1");
  const int width = 40, height = 24;
  const auto coded = coded_frame (schedule, width, height, light);
  ASSERT_EQ (schedule.slots (), 8);
  ExtractOptions select;
  select.method = Method::kSelect;

  const auto &regions = schedule.regions ();
  for (int i = 0; i < 2; i++) {
    const Schedule &part = schedule.region (i);
    const Rect &rect = regions[std::size_t (i)].rect;
    const auto subframes = extract (part, pixels_of (rect, coded), select);
    ASSERT_EQ (int (subframes.size ()), part.slots ());
    const SampleGrid grid (part);
    for (int k = 0; k < part.slots (); k++)
      for (int y = 0; y < subframes[std::size_t (k)].height (); y++)
        for (int x = 0; x < subframes[std::size_t (k)].width (); x++) {
          const Offset at = grid.offset (k, x, y);
          const int cx = rect.x + x * part.cell ().width + at.x;
          const int cy = rect.y + y * part.cell ().height + at.y;
          ASSERT_EQ (subframes[std::size_t (k)].at (x, y), coded.at (cx, cy));
        }
  }
  EXPECT_EQ (coded.at (8 + 1, 4),
      (light (9, 4, 1) + 2) / 4); // one slot of the 4 that n = 2 has
}

TEST (Regions, WhiteIsWhiteInEveryPart)
{
  const Schedule schedule = preset (
      "sequential:2x2,leak=0.01,region=16x8+8+4:staircase:4x2,region=8x8+30+8:"
      "sequential:2x1");
  const auto grey = [] (int, int, int) { return std::uint8_t (200); };
  const auto coded = coded_frame (schedule, 40, 24, grey);
  const auto near_grey = [] (const Image<std::uint8_t> &subframe, Rect but) {
    for (int y = 0; y < subframe.height (); y++)
      for (int x = 0; x < subframe.width (); x++)
        if (!but.holds (x, y)) {
          ASSERT_NEAR (subframe.at (x, y), 200, 8) << x << ", " << y;
        }
  };
  for (int i = 0; i < 2; i++)
    for (const auto &subframe : extract (schedule.region (i),
             pixels_of (schedule.regions ()[std::size_t (i)].rect, coded)))
      near_grey (subframe, {});

  /* All cells of the background; those that regions touch are black. */
  for (const auto &subframe : extract (schedule, coded.view ())) {
    EXPECT_EQ (subframe.at (4, 2), 0);
    EXPECT_EQ (subframe.at (11, 5), 0);
    EXPECT_EQ (subframe.at (15, 4), 0);
    EXPECT_GT (subframe.at (3, 2), 150);
    EXPECT_GT (subframe.at (14, 4), 150);
  }
}

namespace
{

/** Brightness that is constant in time and linear over the frame. */
std::uint8_t
ramp (int x, int y, int)
{
  return std::uint8_t (20 + 6 * x + 4 * y);
}

/** Cells of 2x2 that the region 6x6+3+5 touches. */
bool
covered (int x, int y)
{
  return x >= 1 && x <= 4 && y >= 2 && y <= 5;
}

} // namespace

TEST (Regions, CellsOfTheBackgroundThatTheyTouchAreBlack)
{
  for (const char *background : {"sequential:2x2", "staircase:2x2"}) {
    const Schedule schedule =
        preset (std::string (background) + ",region=6x6+3+5:sequential:3x2");
    const auto coded = coded_frame (schedule, 16, 14, ramp);
    for (const auto &subframe : extract (schedule, coded.view ()))
      for (int y = 0; y < 7; y++)
        for (int x = 0; x < 8; x++)
          EXPECT_EQ (subframe.at (x, y) == 0, covered (x, y))
              << background << ": " << x << ", " << y;
  }
}

/* A region does not change the light: the parts of the next cells inside it are
 * left out, and nothing else changes. */
TEST (Regions, DecodeInterpolatesWithoutThem)
{
  const Schedule plain = preset ("staircase:2x2");
  const Schedule schedule =
      preset ("staircase:2x2,region=6x6+3+5:staircase:2x2");
  const auto coded = coded_frame (plain, 16, 14, ramp);
  auto spoilt = coded;
  for (int y = 4; y < 12; y++)
    std::fill_n (spoilt.view ().row (y) + 2, 8, std::uint8_t (255));
  for (const std::string_view target : extract_targets ()) {
    ExtractOptions options;
    options.target = target;
    const auto wanted = extract (plain, coded.view (), options);
    const auto found = extract (schedule, coded.view (), options);
    EXPECT_EQ (extract (schedule, spoilt.view (), options), found) << target;
    for (std::size_t k = 0; k < found.size (); k++)
      for (int y = 0; y < 7; y++)
        for (int x = 0; x < 8; x++) {
          const bool beside = x <= 5 && y >= 1;
          const int value = found[k].at (x, y), whole = wanted[k].at (x, y);
          if (covered (x, y))
            EXPECT_EQ (value, 0);
          else if (beside)
            EXPECT_NEAR (value, whole, 16) << x << ", " << y;
          else
            EXPECT_EQ (value, whole) << x << ", " << y;
        }
    /* At a corner of the region, the plane through the other cells is
     * extrapolated. */
    EXPECT_EQ (found[1].at (0, 1), wanted[1].at (0, 1));
    EXPECT_EQ (found[3].at (5, 6), wanted[3].at (5, 6));
  }
}

namespace
{

std::vector<Image<std::uint8_t>>
fused (const Schedule &schedule, int width, int height,
    std::uint8_t (*scene) (int, int, int))
{
  const auto coded = coded_frame (schedule, width, height, scene);
  auto fuser = Fuser<std::uint8_t>::make (schedule, width, height);
  EXPECT_TRUE (fuser.ok ()) << fuser.error ().message;
  const Extent size = fuser->size ();
  std::vector<Image<std::uint8_t>> frames (std::size_t (fuser->slots ()),
      Image<std::uint8_t> (size.width, size.height));
  std::vector<ImageView<std::uint8_t>> views;
  for (auto &frame : frames)
    views.push_back (frame.view ());
  for (int i = 0; i < 3; i++) {
    EXPECT_TRUE (fuser->take (coded.view ()));
    EXPECT_TRUE (fuser->fuse (views));
  }
  return frames;
}

} // namespace

TEST (Regions, AreFusedIntoOnePicture)
{
  const Schedule schedule =
      preset ("sequential:2x2,pilot=4,region=24x16+8+4:sequential:lattice:8/3,"
              "region=16x16+40+24:sequential:2x1");
  constexpr int kWidth = 64, kHeight = 52;
  const auto still = [] (int x, int y, int) {
    return std::uint8_t (40 + 2 * x + y);
  };
  const auto frames = fused (schedule, kWidth, kHeight, still);
  ASSERT_EQ (frames.size (), 8u);
  for (const auto &frame : frames) {
    ASSERT_EQ (frame.width (), kWidth);
    ASSERT_EQ (frame.height (), kHeight - 4);
    for (int y = 0; y < kHeight - 4; y++)
      for (int x = 0; x < kWidth; x++)
        ASSERT_NEAR (frame.at (x, y), still (x, y, 0), 6) << x << ", " << y;
  }
}

TEST (Regions, SlowerPartsAreHeldInTheFusedPicture)
{
  const Schedule schedule =
      preset ("sequential:2x2,region=16x16+8+8:sequential:4x2");
  const auto flash = [] (int, int, int slot) {
    return std::uint8_t (slot >= 4 ? 200 : 40);
  };
  const auto frames = fused (schedule, 32, 32, flash);
  ASSERT_EQ (frames.size (), 8u);
  for (int k = 0; k < 8; k++) {
    const auto &frame = frames[std::size_t (k)];
    EXPECT_NEAR (frame.at (2, 2), k >= 4 ? 200 : 40, 20) << k;
    EXPECT_NEAR (frame.at (16, 16), k >= 4 ? 200 : 40, 20) << k;
    EXPECT_EQ (frame.at (2, 2), frames[std::size_t (k / 2 * 2)].at (2, 2));
  }
}

TEST (Regions, ThatTheFusedFrameDoesNotHoldAreSaid)
{
  const auto fuser = Fuser<std::uint8_t>::make (preset (kTwo), 35, 20);
  ASSERT_FALSE (fuser.ok ());
  EXPECT_NE (
      fuser.error ().message.find ("region 1, 6x6+30+10"), std::string::npos)
      << fuser.error ().message;
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How a coded frame is split: parts, times and order. */
#include "extract/split_plan.h"

#include <string>

#include <gtest/gtest.h>

namespace
{

using namespace codedexposure;

constexpr FrameRate kRate{25, 1};
constexpr Nanoseconds kMs = 1'000'000;

Schedule
preset (const std::string &text)
{
  auto made = Schedule::from_preset (text);
  EXPECT_TRUE (made) << text;
  return made ? *made : Schedule ();
}

SlotPlan
slots_of (const Schedule &schedule)
{
  return *SlotPlan::fit (schedule.timing (), schedule.slots (), kRate);
}

std::vector<LightWindow>
windows (const std::string &text, Method method)
{
  const Schedule schedule = preset (text + ",active=9ms,switching=1ms");
  return light_windows (schedule, method, slots_of (schedule));
}

std::vector<SplitPart>
split (const std::string &text, Extent size, bool wide = false,
    const ExtractOptions &options = {})
{
  const Schedule schedule = preset (text);
  auto parts = make_split_plan (
      schedule, {size, wide, kRate, slots_of (schedule)}, options);
  EXPECT_TRUE (parts);
  return parts ? std::move (*parts) : std::vector<SplitPart> ();
}

using Windows = std::vector<LightWindow>;

TEST (LightWindows, AreSlotsWhereTheCodeIsSolvedOrOneHot)
{
  const Windows slots = {{0, 9 * kMs}, {10 * kMs, 9 * kMs}, {20 * kMs, 9 * kMs},
      {30 * kMs, 9 * kMs}};
  EXPECT_EQ (windows ("sequential:2x2", Method::kSelect), slots);
  EXPECT_EQ (windows ("sequential:2x2", Method::kDecode), slots);
  EXPECT_EQ (windows ("staircase:2x2", Method::kDecode), slots);
}

TEST (LightWindows, AreAllSlotsInWhichTheElementIsOn)
{
  const Windows cumulative = {
      {0, 9 * kMs}, {0, 19 * kMs}, {0, 29 * kMs}, {0, 39 * kMs}};
  EXPECT_EQ (windows ("staircase:2x2", Method::kSelect), cumulative);
  EXPECT_EQ (windows ("staircase:2x2", Method::kRank), cumulative);
}

TEST (LightWindows, AreTheWholeExposureWhereARankTellsNoElement)
{
  const LightWindow whole{0, 39 * kMs};
  EXPECT_EQ (windows ("sequential:2x2", Method::kRank), Windows (4, whole));
}

TEST (SplitPlan, OfAPlainScheduleIsOnePart)
{
  const auto parts = split ("sequential:2x2", {12, 8});
  ASSERT_EQ (parts.size (), 1u);
  EXPECT_EQ (parts[0].region, -1);
  EXPECT_EQ (parts[0].rect, (Rect{0, 0, 12, 8}));
  EXPECT_EQ (parts[0].boundaries,
      (std::vector<Nanoseconds>{0, 10 * kMs, 20 * kMs, 30 * kMs, 40 * kMs}));
  EXPECT_EQ (parts[0].period (), 40 * kMs);
  EXPECT_EQ (parts[0].method (), Method::kSelect);
  EXPECT_TRUE (
      std::holds_alternative<Extractor<std::uint8_t>> (parts[0].extractor));
  EXPECT_TRUE (std::holds_alternative<Extractor<std::uint16_t>> (
      split ("sequential:2x2", {12, 8}, true)[0].extractor));
}

constexpr char kRegions[] = "sequential:2x2,region=8x6+4+2:sequential:4x2";

TEST (SplitPlan, OfRegionsHasTheBackgroundFirstAndEachWithItsOwnTimes)
{
  const auto parts = split (kRegions, {24, 16});
  ASSERT_EQ (parts.size (), 2u);
  EXPECT_EQ (parts[0].region, -1);
  EXPECT_EQ (parts[0].subframes (), 4);
  EXPECT_EQ (parts[1].region, 0);
  EXPECT_EQ (parts[1].subframes (), 8);
  EXPECT_EQ (parts[1].rect, (Rect{4, 2, 8, 6}));
  EXPECT_EQ (parts[1].boundaries[3], 15 * kMs);
  EXPECT_EQ (parts[1].period (), parts[0].period ());
  /* The background holds each of its masks for two of the eight slots. */
  EXPECT_EQ (parts[0].windows[1], (LightWindow{10 * kMs, 10 * kMs}));
  EXPECT_EQ (parts[1].windows[1], (LightWindow{5 * kMs, 5 * kMs}));
}

TEST (SplitPlan, GainOfRegionsIsInProportionToTheirSlots)
{
  const auto parts = split (
      kRegions, {24, 16}, false, {.method = Method::kDecode, .gain = 3.0});
  ASSERT_EQ (parts.size (), 2u);
  EXPECT_DOUBLE_EQ (parts[0].gain (), 3.0);
  EXPECT_DOUBLE_EQ (parts[1].gain (), 6.0);
}

TEST (SplitPlan, OfARegionOutsideOfTheFrameIsAnError)
{
  const Schedule schedule = preset (kRegions);
  EXPECT_FALSE (make_split_plan (
      schedule, {{10, 16}, false, kRate, slots_of (schedule)}, {}));
  EXPECT_FALSE (make_split_plan (Schedule (),
      {{24, 16}, false, kRate, slots_of (Schedule ())}, {.gain = -1.0}));
}

TEST (SplitOrder, IsThatOfTimeWithTheBackgroundFirst)
{
  const auto parts =
      split ("sequential:2x1,region=4x4+4+2:sequential:2x2", {24, 16});
  EXPECT_EQ (order_subframes (parts, false),
      (std::vector<SplitTurn>{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {1, 2}, {1, 3}}));
  EXPECT_EQ (order_subframes (parts, true),
      (std::vector<SplitTurn>{{1, 3}, {0, 1}, {1, 2}, {1, 1}, {0, 0}, {1, 0}}));
}

} // namespace

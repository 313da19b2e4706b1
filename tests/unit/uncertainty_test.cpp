/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The uncertainty of fused pixels. */
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "fuse/fuser.h"
#include "preset.h"

namespace
{

using namespace codedexposure;

constexpr int kWidth = 43, kHeight = 38, kCoded = 3;

/* Coded frames of stripes that move to the right of x = 20 and stand still to
 * the left, with some noise. */
std::vector<Image<std::uint8_t>>
coded_frames (int noise)
{
  std::vector<Image<std::uint8_t>> frames;
  for (int number = 0; number < kCoded; number++) {
    auto &frame = frames.emplace_back (kWidth, kHeight);
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++)
        frame.at (x, y) = std::uint8_t (
            ((x < 20 ? x : x - 3 * number) / 3 + y / 4) % 2 * 90 + 80 +
            (noise ? (7 * x + 13 * y + 29 * number) % noise : 0));
  }
  return frames;
}

struct Result {
  std::vector<Image<std::uint8_t>> fused;
  std::vector<Image<std::uint16_t>> deviations;
};

/* Of the last coded frame. A partner sees what it does. */
Result
fuse (const Schedule &schedule, const FuseOptions &options, int noise,
    bool deviations = true, const CodedErrors &errors = {})
{
  auto fuser =
      Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, options).value ();
  const auto n = std::size_t (schedule.slots ());
  Result result{{n, Image<std::uint8_t> (kWidth, fuser.size ().height)}, {}};
  if (deviations)
    result.deviations.assign (
        n, Image<std::uint16_t> (kWidth, fuser.size ().height));
  std::vector<ImageView<std::uint8_t>> views;
  std::vector<ImageView<std::uint16_t>> deviation_views;
  for (auto &image : result.fused)
    views.push_back (image.view ());
  for (auto &image : result.deviations)
    deviation_views.push_back (image.view ());
  for (const auto &frame : coded_frames (noise)) {
    std::optional<ImageView<const std::uint8_t>> partner;
    if (options.partner)
      partner = frame.view ();
    EXPECT_TRUE (fuser.take (frame.view (), partner, errors));
    EXPECT_TRUE (fuser.fuse (views, {}, deviation_views));
  }
  return result;
}

TEST (Uncertainty, NeitherThreadsNorTargetsNorQualityOfFusionDependOnIt)
{
  const Schedule schedule = test::schedule_of ("sequential:lattice:4/2");
  for (const FuseQuality quality :
      {FuseQuality::kFast, FuseQuality::kBalanced, FuseQuality::kLearned}) {
    FuseOptions options;
    options.quality = quality;
    options.noise = {10000.0, 5.0};
    options.threads = 1;
    const Result expected = fuse (schedule, options, 3);
    EXPECT_EQ (fuse (schedule, options, 3, false).fused, expected.fused);
    options.threads = 3;
    for (const std::string_view target : fuse_targets ()) {
      options.target = target;
      const Result other = fuse (schedule, options, 3);
      EXPECT_EQ (other.fused, expected.fused) << target;
      EXPECT_EQ (other.deviations, expected.deviations) << target;
      if (quality != FuseQuality::kFast)
        break;
    }
  }
}

/* Rounding has a standard deviation of a step / sqrt (12). */
TEST (Uncertainty, MeasuredAndStaticPixelsHaveTheRoundingOfTheCamera)
{
  const Schedule schedule = test::schedule_of ("sequential:2x2");
  const Result result = fuse (schedule, {}, 0);
  const int rounding = int (std::lround (256.0 / std::sqrt (12.0)));
  for (int s = 0; s < 4; s++)
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++) {
        const int deviation = result.deviations[std::size_t (s)].at (x, y);
        const bool measured = s == x % 2 + 2 * (y % 2);
        EXPECT_GE (deviation, rounding);
        if (measured || x < 10) {
          EXPECT_EQ (deviation, rounding) << s << ' ' << x << ' ' << y;
        }
        if (!measured && x > 28) {
          EXPECT_GT (deviation, 2 * rounding) << s << ' ' << x << ' ' << y;
        }
      }
}

TEST (Uncertainty, SlotsBeyond128AreMeasured)
{
  const Schedule schedule = test::schedule_of ("sequential:13x10");
  const Result result = fuse (schedule, {}, 0);
  const int rounding = int (std::lround (256.0 / std::sqrt (12.0)));
  for (const int slot : {127, 128, 129})
    EXPECT_EQ (result.deviations[std::size_t (slot)].at (
                   26 + slot % 13, 20 + slot / 13),
        rounding)
        << slot;
}

/* The mean of three frames has a third of the variance. */
TEST (Uncertainty, StaticPixelsHaveTheNoiseOfTheirMean)
{
  FuseOptions options;
  options.noise = {10000.0, 5.0};
  const Result result = fuse (test::schedule_of ("sequential:2x2"), options, 0);
  const double light = result.fused[0].at (4, 9) / 255.0, white = 2500.0;
  const double variance =
      (light * white + 25.0) / (white * white) * 65025.0 + 1.0 / 12.0;
  EXPECT_NEAR (result.deviations[0].at (4, 9) / 256.0,
      std::sqrt (variance / 3.0 + 1.0 / 12.0), 0.1);
}

TEST (Uncertainty, KnownErrorsOfACodedFrameAreAdded)
{
  const Schedule schedule = test::schedule_of ("sequential:2x2");
  Image<float> errors (kWidth, kHeight);
  for (int y = 0; y < kHeight; y++)
    for (int x = 0; x < kWidth; x++)
      errors.at (x, y) = float (x % 5) / 2;
  const Result without = fuse (schedule, {}, 3);
  const Result with = fuse (schedule, {}, 3, true, {.coded = errors.view ()});
  EXPECT_EQ (with.fused, without.fused);
  for (std::size_t s = 0; s < 4; s++)
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++)
        ASSERT_NEAR (with.deviations[s].at (x, y),
            std::hypot (
                without.deviations[s].at (x, y), 256 * errors.at (x, y)),
            1.0);
  auto fuser =
      Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, {}).value ();
  const Image<float> small (kWidth, kHeight - 1);
  const auto refused =
      fuser.take (coded_frames (0)[0].view (), {}, {.coded = small.view ()});
  ASSERT_FALSE (refused);
  EXPECT_NE (refused.error ().message.find ("errors of the coded frame"),
      std::string::npos)
      << refused.error ().message;
}

/* In every slot in which the mirror was off; what the first camera measured
 * does not follow the second one. */
TEST (Uncertainty, KnownErrorsOfAPartnerAreAdded)
{
  const Schedule schedule = test::schedule_of ("sequential:2x2");
  FuseOptions options;
  options.partner = true;
  Image<float> errors (kWidth, kHeight);
  for (int y = 0; y < kHeight; y++)
    for (int x = 0; x < kWidth; x++)
      errors.at (x, y) = float (x % 5) / 2;
  const Result without = fuse (schedule, options, 3);
  const Result with =
      fuse (schedule, options, 3, true, {.partner = errors.view ()});
  EXPECT_EQ (with.fused, without.fused);
  for (int s = 0; s < 4; s++)
    for (int y = 0; y < kHeight; y++)
      for (int x = 28; x < kWidth; x++) {
        const bool measured = s == x % 2 + 2 * (y % 2);
        const double before = without.deviations[std::size_t (s)].at (x, y);
        ASSERT_NEAR (with.deviations[std::size_t (s)].at (x, y),
            std::hypot (before, measured ? 0.0 : 256 * errors.at (x, y)), 1.0)
            << s << ' ' << x << ' ' << y;
      }
}

TEST (Uncertainty, EachSlotOfARegionHasItsOwn)
{
  const Schedule schedule =
      test::schedule_of ("sequential:2x2,region=16x16+20+8:sequential:2x1");
  const Result result = fuse (schedule, {}, 0);
  EXPECT_EQ (result.deviations.size (), std::size_t (schedule.slots ()));
  EXPECT_EQ (
      result.deviations[0].at (25, 12), result.deviations[1].at (25, 12));
  for (const auto &image : result.deviations)
    EXPECT_GT (image.at (25, 12), 0);
}

TEST (Uncertainty, TooFewViewsAreRefused)
{
  auto fuser = Fuser<std::uint8_t>::make (
      test::schedule_of ("sequential:2x2"), kWidth, kHeight)
                   .value ();
  ASSERT_TRUE (fuser.take (coded_frames (0)[0].view ()));
  std::vector<Image<std::uint8_t>> fused (
      4, Image<std::uint8_t> (kWidth, kHeight));
  std::vector<ImageView<std::uint8_t>> views;
  for (auto &image : fused)
    views.push_back (image.view ());
  Image<std::uint16_t> one (kWidth, kHeight);
  const ImageView<std::uint16_t> deviations[] = {one.view ()};
  const auto refused = fuser.fuse (views, {}, deviations);
  ASSERT_FALSE (refused);
  EXPECT_NE (refused.error ().message.find ("1 views instead of 4"),
      std::string::npos);
  EXPECT_EQ (fuser.pending (), 1);
}

} // namespace

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Fusion with a second camera in the beam of the mirrors that are off. */
#include <optional>

#include <gtest/gtest.h>

#include "fuse/fuser.h"
#include "fuse/partner_correction.h"
#include "two_beams.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;
using namespace codedexposure::test::two_beams;

constexpr FuseQuality kQualities[] = {FuseQuality::kFast,
    FuseQuality::kBalanced, FuseQuality::kBest, FuseQuality::kLearned};

/* @partners: none, or one for each frame; an empty one is lost. */
Pictures
fuse (const Schedule &schedule, const Pictures &frames,
    const Pictures &partners, FuseOptions options = {})
{
  auto fuser = Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, options);
  EXPECT_TRUE (fuser) << fuser.error ().message;
  Pictures fused;
  for (std::size_t i = 0; i < frames.size (); i++) {
    std::optional<ImageView<const std::uint8_t>> partner;
    if (i < partners.size () && partners[i].width () > 0)
      partner = partners[i].view ();
    const auto taken = fuser->take (frames[i].view (), partner);
    EXPECT_TRUE (taken) << taken.error ().message;
    std::vector<ImageView<std::uint8_t>> views;
    Pictures slots (
        std::size_t (fuser->slots ()), Image<std::uint8_t> (kWidth, kHeight));
    for (auto &slot : slots)
      views.push_back (slot.view ());
    EXPECT_TRUE (fuser->fuse (views));
    std::ranges::move (slots, std::back_inserter (fused));
  }
  return fused;
}

/* Of all frames, without the pixels at the border. */
double
psnr (const Pictures &fused, const Pictures &truth)
{
  constexpr int kBorder = 8;
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < fused.size (); i++)
    for (int y = kBorder; y < kHeight - kBorder; y++)
      for (int x = kBorder; x < kWidth - kBorder; x++) {
        const double error = fused[i].at (x, y) - truth[i].at (x, y);
        sum += error * error;
        count++;
      }
  return 10.0 * std::log10 (255.0 * 255.0 / std::max (sum / count, 1e-9));
}

FuseOptions
with_partner (FuseQuality quality = FuseQuality::kFast)
{
  return {.quality = quality, .partner = true};
}

bool
equal (const Pictures &a, const Pictures &b)
{
  return std::ranges::equal (a, b, [] (const auto &one, const auto &other) {
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++)
        if (one.at (x, y) != other.at (x, y))
          return false;
    return true;
  });
}

/* Light of the whole exposure has the whole resolution at once. */
TEST (FusePartner, AStaticSceneIsSharpInTheFirstFrame)
{
  const Schedule schedule = schedule_of (kPreset);
  const auto slots = truth (1, schedule.slots (), 0.0);
  const auto frames = coded (schedule, slots);
  const auto partners = coded (schedule.complement ().value (), slots);
  const FuseOptions alone{.quality = FuseQuality::kBalanced};
  const double one = psnr (fuse (schedule, frames, {}, alone), slots);
  const double both = psnr (
      fuse (schedule, frames, partners, with_partner (alone.quality)), slots);
  EXPECT_GT (both, one + 5.0);
  EXPECT_GT (both, 40.0);
}

TEST (FusePartner, MotionGainsAtEveryQuality)
{
  const Schedule schedule = schedule_of (kPreset);
  const auto slots = truth (3, schedule.slots (), 1.3);
  const auto frames = coded (schedule, slots);
  const auto partners = coded (schedule.complement ().value (), slots);
  for (const FuseQuality quality : kQualities) {
    const FuseOptions alone{.quality = quality};
    const double one = psnr (fuse (schedule, frames, {}, alone), slots);
    const double both =
        psnr (fuse (schedule, frames, partners, with_partner (quality)), slots);
    EXPECT_GT (both, one + 1.5) << quality_name (quality);
  }
}

/* By the pixels of the first camera alone, it is 27.5 and 25.3 dB. */
TEST (FusePartner, ItsPixelsTellWhichMotionFits)
{
  const Schedule schedule = schedule_of (kPreset);
  const auto fused = [&] (double speed) {
    const auto slots = truth (3, schedule.slots (), speed);
    return psnr (fuse (schedule, coded (schedule, slots),
                     coded (schedule.complement ().value (), slots),
                     with_partner (FuseQuality::kBalanced)),
        slots);
  };
  EXPECT_GT (fused (0.5), 28.5);
  EXPECT_GT (fused (3.0), 25.5);
}

/* The gain of the second camera is measured, and its black level need not be
 * exact. */
TEST (FusePartner, GainAndBlackLevelAreNotNeeded)
{
  const Schedule schedule = schedule_of (kPreset);
  const auto slots = truth (2, schedule.slots (), 1.3);
  const auto frames = coded (schedule, slots);
  const Schedule off = schedule.complement ().value ();
  const double good = psnr (
      fuse (schedule, frames, coded (off, slots), with_partner ()), slots);
  BenchOptions worse;
  worse.gain = 0.95 * 4.0 / 3.0;
  worse.black_level = 8.0;
  const double bad =
      psnr (fuse (schedule, frames, coded (off, slots, worse), with_partner ()),
          slots);
  EXPECT_GT (bad, good - 0.1);
  FuseOptions known = with_partner ();
  known.partner_black = worse.black_level;
  EXPECT_GT (
      psnr (fuse (schedule, frames, coded (off, slots, worse), known), slots),
      good - 0.1);

  for (const double gain : {1.0, 0.5}) {
    BenchOptions dim;
    dim.gain = gain;
    EXPECT_GT (
        psnr (fuse (schedule, frames, coded (off, slots, dim), with_partner ()),
            slots),
        good - 0.1)
        << gain;
  }
}

/* As behind a grey filter. */
TEST (FusePartner, APartnerWithMoreNoiseCountsLess)
{
  const Schedule schedule = schedule_of (kPreset);
  const auto slots =
      moving_clouds ({kWidth, kHeight}, 4 * schedule.slots (), 0.6);
  BenchOptions bench;
  bench.full_well = 10000.0;
  bench.read_noise = 5.0;
  const auto frames = coded (schedule, slots, bench);
  FuseOptions options;
  options.noise = {10000.0, 5.0};
  const double alone = psnr (fuse (schedule, frames, {}, options), slots);
  bench.full_well = 400.0;
  bench.seed = 1;
  const auto partners = coded (schedule.complement ().value (), slots, bench);
  for (const FuseQuality quality :
      {FuseQuality::kFast, FuseQuality::kBalanced}) {
    options.quality = quality;
    options.partner = true;
    options.partner_noise.reset ();
    const double untold =
        psnr (fuse (schedule, frames, partners, options), slots);
    options.partner_noise = {400.0, 5.0};
    const double told =
        psnr (fuse (schedule, frames, partners, options), slots);
    EXPECT_LT (untold, told - 1.0) << quality_name (quality);
    EXPECT_GT (told, alone - 0.25) << quality_name (quality);
  }
}

/* Three frames that are white on the left, and dark elsewhere. */
Pictures
bright_left (int columns)
{
  auto slots = truth (3, schedule_of (kPreset).slots (), 0.6);
  for (auto &slot : slots)
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++)
        slot.at (x, y) = x < columns ? std::uint8_t (255)
                                     : std::uint8_t (slot.at (x, y) / 4);
  return slots;
}

/* Three frames with few bright places. */
Pictures
mostly_dark (int count)
{
  auto slots = truth (3, count, 0.6);
  for (auto &slot : slots)
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++)
        slot.at (x, y) = std::uint8_t (slot.at (x, y) * slot.at (x, y) / 255);
  return slots;
}

/* A camera that is saturated by so small a part of white. */
BenchOptions
times_brighter (int times, const Schedule &schedule)
{
  BenchOptions bench;
  bench.gain = times * schedule.slots () / schedule.white_slots ();
  return bench;
}

/* The first camera is saturated by half of white; in its frames alone, all that
 * is brighter is missing. */
TEST (FusePartner, SeesBeyondWhiteOfTheFirstCamera)
{
  for (const char *preset :
      {kPreset, "sequential:2x2,region=32x24+16+12:sequential:4x2"}) {
    const Schedule schedule = schedule_of (preset);
    const auto slots = mostly_dark (schedule.slots ());
    const auto frames = coded (schedule, slots, times_brighter (2, schedule));
    const auto partners = coded (schedule.complement ().value (), slots);
    FuseOptions options = with_partner ();
    options.range = 2;
    const double both =
        psnr (fuse (schedule, frames, partners, options), slots);
    EXPECT_GT (both, psnr (fuse (schedule, coded (schedule, slots), {}), slots))
        << preset;
    EXPECT_LT (psnr (fuse (schedule, frames, {}, options), slots), both - 0.5)
        << preset;
  }
}

/* Frames of both in the first @p columns, and 16 px beside them, are those of
 * the first camera alone, and others elsewhere, at every quality. */
void
expect_alone_left_of (int columns, const Schedule &schedule,
    const Pictures &frames, const Pictures &partners, bool others = true)
{
  constexpr int kReach = 16;
  for (const FuseQuality quality :
      {FuseQuality::kFast, FuseQuality::kBalanced, FuseQuality::kBest}) {
    const FuseOptions alone{.quality = quality};
    const auto one = fuse (schedule, frames, {}, alone);
    const auto both = fuse (schedule, frames, partners, with_partner (quality));
    ASSERT_EQ (both.size (), one.size ());
    bool other = false;
    for (std::size_t s = 0; s < one.size (); s++)
      for (int y = 0; y < kHeight; y++)
        for (int x = 0; x < kWidth; x++)
          if (x < columns + kReach)
            ASSERT_EQ (both[s].at (x, y), one[s].at (x, y))
                << quality_name (quality) << ' ' << s << ' ' << x << ' ' << y;
          else
            other |= both[s].at (x, y) != one[s].at (x, y);
    EXPECT_TRUE (other || !others) << quality_name (quality);
  }
}

/* Where it is saturated far beyond white, what the second one sees there does
 * not fit into the frames. */
TEST (FusePartner, AnOverexposedFirstCameraIsAloneThere)
{
  constexpr int kBright = 10;
  const Schedule schedule = schedule_of (kPreset);
  const auto slots = bright_left (kBright);
  const auto frames = coded (schedule, slots, times_brighter (4, schedule));
  const auto partners = coded (schedule.complement ().value (), slots);
  expect_alone_left_of (kBright, schedule, frames, partners);
}

/* Its left side saturates both; what is beyond white there is not known. */
TEST (FusePartner, SaturatedPartnersTellNothingBeyondWhite)
{
  constexpr int kBright = 30;
  const Schedule schedule = schedule_of (kPreset);
  const auto slots = bright_left (kBright);
  FuseOptions options = with_partner ();
  options.range = 4;
  const auto fused =
      fuse (schedule, coded (schedule, slots, times_brighter (4, schedule)),
          coded (schedule.complement ().value (), slots), options);
  for (const auto &frame : fused)
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kBright - 10; x++)
        ASSERT_EQ (frame.at (x, y), 64) << x << ' ' << y;
}

/* No place is dark enough to compare what both see. */
TEST (FusePartner, LightThatCannotBeComparedTellsNothing)
{
  const Schedule schedule = schedule_of (kPreset);
  Image<std::uint8_t> white (kWidth, kHeight), grey (kWidth, kHeight);
  for (int y = 0; y < kHeight; y++)
    for (int x = 0; x < kWidth; x++) {
      white.at (x, y) = 255;
      grey.at (x, y) = std::uint8_t (100 + x);
    }
  for (const int range : {1, 4}) {
    FuseOptions options = with_partner ();
    options.range = range;
    EXPECT_TRUE (equal (fuse (schedule, {white, white}, {grey, grey}, options),
        fuse (schedule, {white, white}, {}, options)))
        << range;
  }
}

/* What the first camera did not measure is less certain. */
TEST (FusePartner, TheUncertaintyBeyondWhiteIsThatOfTheSecondCamera)
{
  const Schedule schedule = schedule_of (kPreset);
  const auto slots = mostly_dark (schedule.slots ());
  const auto coded_frames =
      coded (schedule, slots, times_brighter (2, schedule));
  const auto partners = coded (schedule.complement ().value (), slots);
  FuseOptions options = with_partner ();
  options.range = 2;
  auto fuser =
      Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, options).value ();
  const auto n = std::size_t (schedule.slots ());
  Pictures fused (n, Image<std::uint8_t> (kWidth, kHeight));
  std::vector<Image<std::uint16_t>> widths (
      n, Image<std::uint16_t> (kWidth, kHeight));
  std::vector<ImageView<std::uint8_t>> views;
  std::vector<ImageView<std::uint16_t>> deviations;
  for (std::size_t s = 0; s < n; s++) {
    views.push_back (fused[s].view ());
    deviations.push_back (widths[s].view ());
  }
  ASSERT_TRUE (fuser.take (
      coded_frames[0].view (), std::as_const (partners[0]).view ()));
  ASSERT_TRUE (fuser.fuse (views, {}, deviations));
  double beyond = 0.0, within = 0.0;
  for (std::size_t s = 0; s < n; s++)
    for (int y = 8; y < kHeight - 8; y++)
      for (int x = 8; x < kWidth - 8; x++)
        if (coded_frames[0].at (x, y) == 255 && schedule.on (x, y, int (s))) {
          const double error =
              std::abs (fused[s].at (x, y) - slots[s].at (x, y)) - 0.5;
          beyond++;
          within += error <= widths[s].at (x, y) / 256.0;
        }
  EXPECT_GT (beyond, 100.0);
  EXPECT_GT (within, 0.4 * beyond);
}

TEST (FusePartner, RangesAreNotRefined)
{
  const Schedule schedule = schedule_of (kPreset);
  FuseOptions options = with_partner (FuseQuality::kLearned);
  options.range = 4;
  const auto fuser =
      Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, options);
  ASSERT_TRUE (fuser);
  EXPECT_EQ (fuser->unrefined (),
      "range 4: the refinement was trained for light up to white");
  for (const int range : {0, 17}) {
    options.range = range;
    const auto refused =
        Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, options);
    ASSERT_FALSE (refused);
    EXPECT_EQ (refused.error ().message,
        "range " + std::to_string (range) +
            ": white of fused frames must be 1 to 16 times that of coded ones");
  }
}

TEST (FusePartner, AFrameWithoutItsPartnerIsThatOfOneCamera)
{
  for (const FuseQuality quality : kQualities) {
    const Schedule schedule = schedule_of (kPreset);
    const auto slots = truth (4, schedule.slots (), 1.3);
    const auto frames = coded (schedule, slots);
    auto partners = coded (schedule.complement ().value (), slots);
    const FuseOptions alone{.quality = quality};
    const auto one = fuse (schedule, frames, {}, alone);
    EXPECT_TRUE (
        equal (fuse (schedule, frames, {}, with_partner (quality)), one));

    partners[2] = {};
    const auto mixed =
        fuse (schedule, frames, partners, with_partner (quality));
    const auto third = [] (const Pictures &all) {
      return Pictures (all.begin () + 8, all.begin () + 12);
    };
    EXPECT_TRUE (equal (third (mixed), third (one))) << quality_name (quality);
    EXPECT_FALSE (equal (mixed, one));
  }
}

/* A second camera gets most of the light, and has too much of it first. What it
 * cannot tell is left to the first camera; elsewhere nothing changes. */
TEST (FusePartner, WhereItIsSaturatedTheFirstCameraIsAlone)
{
  constexpr Rect kLamp{24, 18, 6, 4};
  constexpr int kReach = 16;
  const Schedule schedule = schedule_of (kPreset);
  const auto slots = truth (3, schedule.slots (), 1.3);
  const auto frames = coded (schedule, slots);
  const auto partners = coded (schedule.complement ().value (), slots);
  auto dazzled = partners;
  for (int y = kLamp.y; y < kLamp.bottom (); y++)
    for (int x = kLamp.x; x < kLamp.right (); x++)
      dazzled[1].at (x, y) = 255;
  for (const FuseQuality quality : kQualities) {
    const FuseOptions alone{.quality = quality};
    const auto one = fuse (schedule, frames, {}, alone);
    const auto both = fuse (schedule, frames, partners, with_partner (quality));
    const auto some = fuse (schedule, frames, dazzled, with_partner (quality));
    const Rect near{kLamp.x - kReach, kLamp.y - kReach,
        kLamp.width + 2 * kReach, kLamp.height + 2 * kReach};
    for (std::size_t s = 4; s < 8; s++)
      for (int y = 0; y < kHeight; y++)
        for (int x = 0; x < kWidth; x++) {
          if (near.holds (x, y)) {
            ASSERT_EQ (some[s].at (x, y), one[s].at (x, y)) << x << ' ' << y;
          } else if (quality == FuseQuality::kFast) {
            ASSERT_NEAR (some[s].at (x, y), both[s].at (x, y), 1)
                << x << ' ' << y;
          }
        }
    EXPECT_GT (psnr (some, slots), psnr (one, slots) + 0.8)
        << quality_name (quality);
  }
}

/* In all frames, whether the scene moves or not. */
TEST (FusePartner, WhatItDoesNotSeeIsLeftToTheFirstCamera)
{
  constexpr int kUnseen = 9;
  const Schedule schedule = schedule_of (kPreset);
  for (const double speed : {0.0, 0.4, 1.3}) {
    SCOPED_TRACE (speed);
    const auto slots = truth (4, schedule.slots (), speed);
    auto partners = coded (schedule.complement ().value (), slots);
    for (auto &partner : partners)
      for (int y = 0; y < kHeight; y++)
        std::fill_n (partner.view ().row (y), kUnseen, std::uint8_t (255));
    expect_alone_left_of (
        kUnseen, schedule, coded (schedule, slots), partners, speed != 0.0);
  }
}

TEST (FusePartner, RegionsHavePartners)
{
  const Schedule schedule =
      schedule_of ("sequential:2x2,region=32x24+16+12:sequential:4x2");
  const auto slots = truth (2, schedule.slots (), 0.6);
  const auto frames = coded (schedule, slots);
  const auto partners = coded (schedule.complement ().value (), slots);
  EXPECT_GT (psnr (fuse (schedule, frames, partners, with_partner ()), slots),
      psnr (fuse (schedule, frames, {}), slots) + 1.0);
}

/* A second camera whose pixels lie between the mirrors, and its frames as
 * rectified and as corrected. */
template <typename Pixel>
struct Aside {
  std::vector<Image<Pixel>> rectified, corrected;

  Aside (const Schedule &schedule, const Pictures &slots, const Pictures &first,
      int threads, int scale = 1)
  {
    const Schedule complement = schedule.complement ().value ();
    BenchOptions bench;
    bench.gain = 1.0;
    bench.psf_sigma = 0.3;
    bench.alignment = {.shift_x = 0.4, .shift_y = 0.5, .rotation = 0.3};
    Mapping::Parts parts{{kWidth, kHeight}, {kWidth, kHeight},
        camera_to_mirrors (bench.alignment, kWidth, kHeight)};
    parts.psf_sigma = bench.psf_sigma;
    const Rectifier rectifier = Rectifier::make (Mapping::make (parts).value (),
        complement, {.noise = 0.002, .keep_unknown = true, .correct = true})
                                    .value ();
    FuseOptions options;
    options.threads = threads;
    auto correction =
        PartnerCorrection<Pixel>::make (schedule, rectifier, options);
    EXPECT_TRUE (correction) << correction.error ().message;
    const auto scaled = [&] (const Image<std::uint8_t> &image) {
      Image<Pixel> wide (kWidth, kHeight);
      for (int y = 0; y < kHeight; y++)
        for (int x = 0; x < kWidth; x++)
          wide.at (x, y) = Pixel (image.at (x, y) * scale);
      return wide;
    };
    const auto seen = coded (complement, slots, bench);
    for (std::size_t i = 0; i < seen.size (); i++) {
      Image<Pixel> &image = rectified.emplace_back (kWidth, kHeight);
      const Image<Pixel> from = scaled (seen[i]), coded = scaled (first[i]);
      EXPECT_TRUE (rectifier.run (from.view (), image.view ()));
      corrected.push_back (image);
      EXPECT_TRUE (correction->run (coded.view (), corrected.back ().view ()));
    }
  }
};

TEST (FusePartner, BetweenItsPixelsItIsCorrectedByWhatTheFirstCameraTells)
{
  for (const char *preset :
      {kPreset, "sequential:2x2,region=32x24+16+12:sequential:4x2"}) {
    const Schedule schedule = schedule_of (preset);
    const auto slots =
        moving_clouds ({kWidth, kHeight}, 3 * schedule.slots (), 0.6);
    const auto frames = coded (schedule, slots);
    const Aside<std::uint8_t> second (schedule, slots, frames, 1);
    const double alone = psnr (fuse (schedule, frames, {}), slots);
    const auto gain = [&] (const Pictures &partners) {
      return psnr (fuse (schedule, frames, partners, with_partner ()), slots) -
             alone;
    };
    EXPECT_GT (gain (second.corrected), gain (second.rectified) + 0.3)
        << preset;
    EXPECT_TRUE (equal (second.corrected,
        Aside<std::uint8_t> (schedule, slots, frames, 3).corrected));
  }
}

/* A part of a stream gives the same as the whole, and 16 bits as 8. */
TEST (FusePartner, ItsCorrectionKnowsOneFrameOnly)
{
  const Schedule schedule = schedule_of (kPreset);
  const auto slots = truth (2, schedule.slots (), 1.3);
  const Pictures last (slots.begin () + schedule.slots (), slots.end ());
  const auto frames = coded (schedule, slots);
  const Aside<std::uint8_t> whole (schedule, slots, frames, 1);
  const Aside<std::uint8_t> part (schedule, last, {frames.back ()}, 1);
  EXPECT_TRUE (equal ({whole.corrected.back ()}, part.corrected));
  const Aside<std::uint16_t> wide (schedule, last, {frames.back ()}, 1, 257);
  int most = 0;
  for (int y = 0; y < kHeight; y++)
    for (int x = 0; x < kWidth; x++)
      most = std::max (most, std::abs (wide.corrected[0].at (x, y) / 257 -
                                       part.corrected[0].at (x, y)));
  EXPECT_LE (most, 2);
}

/* The result does not depend on threads or the instruction set. */
TEST (FusePartner, AllTargetsAndThreadsAgree)
{
  const Schedule schedule = schedule_of (kPreset);
  const auto slots = truth (2, schedule.slots (), 1.3);
  const auto frames = coded (schedule, slots);
  const auto partners = coded (schedule.complement ().value (), slots);
  for (const FuseQuality quality : kQualities) {
    FuseOptions options = with_partner (quality);
    options.threads = 1;
    const auto expected = fuse (schedule, frames, partners, options);
    for (const auto target : fuse_targets ())
      for (const int threads : {1, 3}) {
        options.target = target;
        options.threads = threads;
        EXPECT_TRUE (
            equal (fuse (schedule, frames, partners, options), expected))
            << quality_name (quality) << ' ' << target << ' ' << threads;
      }
  }
}

TEST (FusePartner, MisuseIsRefused)
{
  const Schedule schedule = schedule_of (kPreset);
  const Image<std::uint8_t> frame (kWidth, kHeight), small (32, 32);
  auto alone = Fuser<std::uint8_t>::make (schedule, kWidth, kHeight).value ();
  const auto refused = alone.take (frame.view (), small.view ());
  ASSERT_FALSE (refused);
  EXPECT_NE (refused.error ().message.find ("FuseOptions::partner"),
      std::string::npos);
  auto both =
      Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, with_partner ())
          .value ();
  EXPECT_FALSE (both.take (frame.view (), small.view ()));
  EXPECT_EQ (both.pending (), 0);
  FuseOptions dark = with_partner ();
  dark.partner_black = -1.0;
  EXPECT_FALSE (Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, dark));
  FuseOptions loud = with_partner ();
  loud.partner_noise = {-1.0, 5.0};
  EXPECT_FALSE (Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, loud));
  /* The last element of a staircase is never in the other beam. */
  const auto never = Fuser<std::uint8_t>::make (
      schedule_of ("staircase:2x2"), kWidth, kHeight, with_partner ());
  ASSERT_FALSE (never);
  EXPECT_NE (
      never.error ().message.find ("is on in every slot"), std::string::npos);
}

} // namespace

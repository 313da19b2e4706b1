/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames of a misaligned camera, resampled to the mirrors. */
#include "rectify/rectifier.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/workers.h"
#include "estimate/mirror_share.h"
#include "misaligned.h"

using namespace codedexposure;

namespace
{

using namespace codedexposure::test::misaligned;

/** Of an alignment without distortion. */
Homography
homography_of (const Alignment &alignment)
{
  const Homography m = camera_to_mirrors (alignment, kSize.width, kSize.height);
  const double cx = 0.5 * (kSize.width - 1), cy = 0.5 * (kSize.height - 1);
  const double zx = alignment.tilt_x / cx, zy = alignment.tilt_y / cy;
  const double z0 = 1.0 - alignment.tilt_x - alignment.tilt_y;
  const double x0 = cx + alignment.shift_x, y0 = cy + alignment.shift_y;
  return {x0 * zx + m[0], x0 * zy + m[1], x0 * z0 - m[0] * cx - m[1] * cy,
      y0 * zx + m[3], y0 * zy + m[4], y0 * z0 - m[3] * cx - m[4] * cy, zx, zy,
      z0};
}

} // namespace

TEST (Rectifier, CopiesWherePixelsAndMirrorsAreOneToOne)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  const Alignment alignment = {3, -2, 0, 1};
  const auto rectifier = made (mapping_of (alignment), schedule);
  EXPECT_EQ (rectifier.report ().weighted, 0u);
  EXPECT_EQ (rectifier.report ().unseen, std::uint64_t (96 * 64 - 93 * 62));
  const auto aligned = coded ({}, schedule);
  const auto mirrors = rectified (rectifier, coded (alignment, schedule));
  for (int y = 0; y < 62; y++)
    for (int x = 3; x < 96; x++)
      ASSERT_EQ (mirrors.at (x, y), aligned.at (x, y)) << x << ' ' << y;
  EXPECT_EQ (mirrors.at (0, 0), 0);
}

TEST (Rectifier, SeparatesWhatPixelsMix)
{
  for (const char *preset :
      {"sequential:2x2", "sequential:lattice:8/3", "staircase:2x2"}) {
    const Schedule schedule = schedule_of (preset);
    const Alignment alignment = {0.4, 0.4, 0.5, 1.01};
    const auto rectifier = made (mapping_of (alignment), schedule);
    const auto &report = rectifier.report ();
    EXPECT_GT (report.weighted, 5000u);
    EXPECT_GT (report.mixed, 1000u);
    EXPECT_LT (report.mixed, report.weighted);
    EXPECT_EQ (report.exact + report.weighted + report.unseen, 96u * 64u);
    const auto aligned = coded ({}, schedule);
    const auto seen = coded (alignment, schedule);
    const double before = rms (seen, aligned, 6);
    EXPECT_LT (rms (rectified (rectifier, seen), aligned, 6), before / 3)
        << preset;
  }
}

/* Next to another part, too. */
TEST (Rectifier, KnowsTheMasksOfEveryRegion)
{
  const Schedule schedule = schedule_of (
      "sequential:2x2,region=27x18+8+9:staircase:3x3,region=32x24+52+26:"
      "sequential:lattice:8/3");
  const Alignment alignment = {0.4, 0.4, 0.5, 1.01};
  const auto rectifier = made (mapping_of (alignment), schedule);
  const auto aligned = coded ({}, schedule);
  const auto seen = coded (alignment, schedule);
  const auto mirrors = rectified (rectifier, seen);
  const auto at_borders = [&] (const Image<std::uint8_t> &frame) {
    double squares = 0.0, count = 0.0;
    for (int y = 6; y < kSize.height - 6; y++)
      for (int x = 6; x < kSize.width - 6; x++) {
        const int part = schedule.region_at (x, y);
        if (schedule.region_at (x - 2, y) == part &&
            schedule.region_at (x + 2, y) == part &&
            schedule.region_at (x, y - 2) == part &&
            schedule.region_at (x, y + 2) == part)
          continue;
        squares += std::pow (double (frame.at (x, y)) - aligned.at (x, y), 2);
        count += 1.0;
      }
    return std::sqrt (squares / count);
  };
  EXPECT_LT (rms (mirrors, aligned, 6), rms (seen, aligned, 6) / 4);
  EXPECT_LT (at_borders (mirrors), at_borders (seen) / 4);
}

TEST (Rectifier, TakesBackTheBlur)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  const auto sharp = coded ({}, schedule);
  const Alignment alignment = {0.4, -0.3, 0.2, 0.995};
  const auto blurred = coded (alignment, schedule, 0.5);
  const auto rectifier = made (mapping_of (alignment, 0.5), schedule);
  EXPECT_LT (rms (rectified (rectifier, blurred), sharp, 6),
      0.8 * rms (coded ({}, schedule, 0.5), sharp, 6));
}

/* A sharp lens mixes so little that weights would add more than they take. */
TEST (Rectifier, TakesBackTheBlurOfAnAlignedCamera)
{
  for (const char *preset :
      {"sequential:2x2", "sequential:lattice:8/3", "staircase:2x2"}) {
    SCOPED_TRACE (preset);
    const Schedule schedule = schedule_of (preset);
    const auto sharp = coded ({}, schedule);
    for (const double blur : {0.1, 0.3, 0.5}) {
      const auto blurred = coded ({}, schedule, blur);
      const auto rectifier = made (mapping_of ({}, blur), schedule);
      EXPECT_EQ (rectifier.report ().weighted, 96u * 64u);
      EXPECT_LT (rms (rectified (rectifier, blurred), sharp, 2),
          rms (blurred, sharp, 2) / 2)
          << blur;
    }
    const auto sharper = made (mapping_of ({}, 0.04), schedule);
    EXPECT_EQ (sharper.report ().exact, 96u * 64u);
    EXPECT_EQ (rectified (sharper, sharp), sharp);
  }
}

/* As a camera with noise sees it: the noise as such is no error. */
TEST (Rectifier, KnowsItsErrors)
{
  constexpr double kWell = 10000.0;
  for (const double blur : {0.2, 0.3, 0.5}) {
    const Schedule schedule = schedule_of ("sequential:lattice:8/3");
    const auto rectifier =
        Rectifier::make (mapping_of ({}, blur), schedule, {.noise = 0.01});
    ASSERT_TRUE (rectifier.ok ());
    const auto seen = coded ({}, schedule, blur, 1, kWell);
    const auto noiseless = coded ({}, schedule);
    Image<std::uint8_t> mirrors (kSize.width, kSize.height);
    Image<float> errors (kSize.width, kSize.height);
    ASSERT_TRUE (
        rectifier->run (seen.view (), mirrors.view (), 0, errors.view ()));
    double expected = 0.0, count = 0.0;
    for (int y = 0; y < kSize.height; y++)
      for (int x = 0; x < kSize.width; x++) {
        /* Of light in an eighth of the exposure. */
        const double electrons = noiseless.at (x, y) / 255.0 * kWell / 8;
        const double noise = std::sqrt (electrons) * 255.0 / (kWell / 8);
        expected += noise * noise + std::pow (errors.at (x, y), 2);
        count++;
      }
    const double error = rms (mirrors, noiseless, 0);
    EXPECT_NEAR (error / std::sqrt (expected / count), 1.0, 0.3) << blur;
  }
}

TEST (Rectifier, KeepsTheBrightnessOfAFlatScene)
{
  for (const char *preset : {"sequential:2x2", "staircase:2x2", "s-matrix:3x1",
           "sequential:3x3,leak=0.02"}) {
    const Schedule schedule = schedule_of (preset);
    const Alignment alignment = {0.5, 0.5, 1.0, 0.99};
    const auto aligned = coded ({}, schedule, 0.0, 0);
    const auto mirrors = rectified (made (mapping_of (alignment), schedule),
        coded (alignment, schedule, 0.0, 0));
    for (int y = 6; y < 58; y++)
      for (int x = 6; x < 90; x++)
        ASSERT_NEAR (mirrors.at (x, y), aligned.at (x, y), 5) << preset;
  }
}

TEST (Rectifier, TakesSeveralPixelsAMirror)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  const Alignment alignment = {0.3, 0.1, 0.5, 2.0};
  const auto rectifier = made (mapping_of (alignment), schedule);
  const auto aligned = coded ({}, schedule);
  const auto mirrors = rectified (rectifier, coded (alignment, schedule));
  /* The camera sees the middle of the mirrors. */
  EXPECT_NEAR (double (rectifier.report ().unseen), 0.75 * 96 * 64, 300.0);
  EXPECT_EQ (rectifier.report ().exact, 0u);
  for (int y = 20; y < 44; y++)
    for (int x = 28; x < 68; x++)
      ASSERT_NEAR (mirrors.at (x, y), aligned.at (x, y), 6) << x << ' ' << y;
}

TEST (Rectifier, TakesNinePixelsAMirror)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  const Alignment alignment = {0.2, -0.4, 0.3, 3.0};
  const auto rectifier = made (mapping_of (alignment), schedule);
  EXPECT_NEAR (double (rectifier.report ().unseen), 96 * 64 * 8 / 9, 200.0);
  const auto aligned = coded ({}, schedule);
  const auto mirrors = rectified (rectifier, coded (alignment, schedule));
  for (int y = 25; y < 39; y++)
    for (int x = 35; x < 61; x++)
      ASSERT_NEAR (mirrors.at (x, y), aligned.at (x, y), 3) << x << ' ' << y;

  /* All nine pixels see the light, so their noise averages out. */
  double alone = 0.0, together = 0.0;
  for (const auto &[at, squares] :
      {std::pair (Alignment (), &alone), std::pair (alignment, &together)}) {
    const auto noisy = coded (at, schedule, 0.0, 0, 10000.0);
    const auto flat = coded (at, schedule, 0.0, 0);
    const bool several = at.scale > 1.0;
    const auto a = several ? rectified (rectifier, noisy) : noisy;
    const auto b = several ? rectified (rectifier, flat) : flat;
    for (int y = 25; y < 39; y++)
      for (int x = 35; x < 61; x++)
        *squares += std::pow (double (a.at (x, y)) - double (b.at (x, y)), 2);
  }
  EXPECT_LT (together, 0.25 * alone);
}

/* The camera sees the middle of the mirrors, and light comes from beyond its
 * frame: where a window does not fit, it is shifted. */
TEST (Rectifier, SeparatesMirrorsAtTheBorderOfTheFrame)
{
  for (const char *preset : {"sequential:2x2", "sequential:lattice:8/3"})
    for (const double scale : {1.2, 2.0, 3.0}) {
      const Schedule schedule = schedule_of (preset);
      const Alignment alignment{0.3, 0.1, 0.5, scale};
      const Mapping mapping = mapping_of (alignment, 0.3);
      const auto rectifier = made (mapping, schedule);
      const auto truth = coded ({}, schedule);
      const auto frame = coded (alignment, schedule, 0.3);
      const auto mirrors = rectified (rectifier, frame);
      const auto seen = [&] (int x, int y) {
        return x >= 0 && y >= 0 && x < kSize.width && y < kSize.height &&
               rectifier.sees (x, y);
      };
      double separated = 0.0, copied = 0.0;
      for (int y = 0; y < kSize.height; y++)
        for (int x = 0; x < kSize.width; x++) {
          if (!seen (x, y))
            continue;
          if (seen (x - 2, y) && seen (x + 2, y) && seen (x, y - 2) &&
              seen (x, y + 2))
            continue;
          const Position at = mapping.camera_at ({double (x), double (y)});
          const double pixel =
              frame.at (int (std::lround (at.x)), int (std::lround (at.y)));
          separated += std::pow (mirrors.at (x, y) - truth.at (x, y), 2);
          copied += std::pow (pixel - truth.at (x, y), 2);
        }
      /* The middle one of nine pixels sees its mirror alone. */
      EXPECT_LE (separated, (scale < 3.0 ? 0.45 : 1.0) * copied)
          << preset << ' ' << scale;
    }
}

TEST (Rectifier, FollowsATilt)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  /* Mirrors that stand at a slant, as their light needs it. */
  const Alignment alignment = {.shift_x = 0.3,
      .shift_y = -0.2,
      .rotation = 0.4,
      .scale = 1.0,
      .tilt_x = 0.05,
      .tilt_y = -0.03};
  Alignment plane = alignment;
  plane.tilt_x = plane.tilt_y = 0.0;
  Mapping::Parts parts = {kSize, kSize, homography_of (alignment)};
  const auto tilted = made (*Mapping::make (parts), schedule);
  const auto straight = made (mapping_of (plane), schedule);
  const auto aligned = coded ({}, schedule);
  const auto left = [&] (const Rectifier &by, const Alignment &of) {
    return rms (rectified (by, coded (of, schedule)), aligned, 8);
  };
  EXPECT_LT (left (tilted, alignment), 1.4 * left (straight, plane));
  EXPECT_GT (left (straight, alignment), 1.5 * left (tilted, alignment));
}

TEST (Rectifier, PixelsOfSixteenBitsAreThoseOfEight)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  const Alignment alignment = {0.4, 0.4, 0.5, 1.01};
  const auto rectifier = made (mapping_of (alignment), schedule);
  const auto frame = coded (alignment, schedule);
  const auto whole = rectified (rectifier, frame);
  Image<std::uint16_t> wide (kSize.width, kSize.height), out = wide;
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++)
      wide.at (x, y) = frame.at (x, y);
  EXPECT_TRUE (rectifier.run (std::as_const (wide).view (), out.view (), 255));
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++)
      ASSERT_EQ (out.at (x, y), whole.at (x, y));
}

TEST (Rectifier, AnyNumberOfThreadsGivesTheSame)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  const Alignment alignment = {0.4, 0.4, 0.5, 1.01};
  const auto rectifier = made (mapping_of (alignment), schedule);
  const auto frame = coded (alignment, schedule);
  const auto whole = rectified (rectifier, frame);
  Image<float> errors (kSize.width, kSize.height), all = errors;
  Image<std::uint8_t> out (kSize.width, kSize.height);
  ASSERT_TRUE (rectifier.run (frame.view (), out.view (), 0, errors.view ()));
  for (const int threads : {1, 2, 5}) {
    Workers workers (threads);
    Image<std::uint8_t> shared (kSize.width, kSize.height);
    ASSERT_TRUE (rectifier.run (
        frame.view (), shared.view (), 0, all.view (), &workers));
    EXPECT_EQ (shared, whole) << threads;
    EXPECT_EQ (all, errors) << threads;
  }
}

/* The estimate of a mirror has a part of one saturated pixel among others. */
TEST (Rectifier, KeepsSaturationWhereItIsAsked)
{
  const Alignment shifted{.shift_x = 0.4, .shift_y = 0.3};
  const Schedule schedule = schedule_of ("sequential:2x2");
  const Mapping mapping = mapping_of (shifted);
  const Rectifier plain = *Rectifier::make (mapping, schedule);
  const Rectifier keeping =
      *Rectifier::make (mapping, schedule, {.keep_unknown = true});
  Image<std::uint8_t> frame = coded (shifted, schedule);
  const Image<std::uint8_t> before = rectified (plain, frame);
  EXPECT_EQ (rectified (keeping, frame), before);
  frame.at (40, 30) = 255;
  const Image<std::uint8_t> without = rectified (plain, frame);
  const Image<std::uint8_t> with = rectified (keeping, frame);
  int saturated = 0, seen = 0;
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++) {
      seen += without.at (x, y) == 255;
      if (with.at (x, y) == 255)
        saturated++;
      else
        EXPECT_EQ (with.at (x, y), before.at (x, y)) << x << ' ' << y;
    }
  EXPECT_EQ (saturated, 5 * 5);
  EXPECT_LT (seen, 2);
  frame.at (40, 30) = 200;
  Image<std::uint8_t> mirrors (kSize.width, kSize.height);
  EXPECT_TRUE (keeping.run (frame.view (), mirrors.view (), 200));
  EXPECT_EQ (mirrors.at (40, 30), 200);
}

TEST (Rectifier, KeepsWhatTheCameraDoesNotSeeWhereItIsAsked)
{
  const Alignment shifted{.shift_x = 7.4};
  const Schedule schedule = schedule_of ("sequential:2x2");
  const auto frame = coded (shifted, schedule);
  const Rectifier plain = made (mapping_of (shifted), schedule);
  const Rectifier keeping = *Rectifier::make (
      mapping_of (shifted), schedule, {.noise = 0.001, .keep_unknown = true});
  const auto black = rectified (plain, frame);
  const auto marked = rectified (keeping, frame);
  EXPECT_EQ (plain.report ().unseen, 7u * 64u);
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++) {
      EXPECT_EQ (plain.sees (x, y), x >= 7);
      EXPECT_EQ (marked.at (x, y), x >= 7 ? black.at (x, y) : 255);
      if (x < 7) {
        EXPECT_EQ (black.at (x, y), 0);
      }
    }
}

TEST (Rectifier, NothingComesOverFromTheOtherSideOfTheFrame)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  for (const double scale : {1.01, 2.0, 3.0}) {
    const Alignment alignment = {0.4, 0.4, 0.5, scale};
    const auto rectifier = made (mapping_of (alignment), schedule);
    const auto frame = coded (alignment, schedule);
    const auto mirrors = rectified (rectifier, frame);
    for (const bool columns : {true, false}) {
      const int length = columns ? kSize.width : kSize.height;
      for (const bool low : {true, false}) {
        Image<std::uint8_t> lit = frame;
        for (int y = 0; y < kSize.height; y++)
          for (int x = 0; x < kSize.width; x++)
            if (const int at = columns ? x : y; low ? at < 8 : at >= length - 8)
              lit.at (x, y) = 255;
        const auto changed = rectified (rectifier, lit);
        int differ = 0;
        for (int y = 0; y < kSize.height; y++)
          for (int x = 0; x < kSize.width; x++) {
            const int at = columns ? x : y;
            const bool far = low ? at >= length / 2 : at < length / 2;
            const bool same = changed.at (x, y) == mirrors.at (x, y);
            differ += !same;
            ASSERT_TRUE (same || !far) << scale << ": " << x << ' ' << y;
          }
        EXPECT_GT (differ, 0);
      }
    }
  }
}

/* Also with a large rotation; pixels are as large as mirrors. */
TEST (Rectifier, MixedMirrorsAreThoseThatNoPixelLooksAt)
{
  const Mapping mapping = mapping_of ({0.3, 0.1, 20, 1});
  const auto report = made (mapping, schedule_of ("sequential:2x2")).report ();
  const auto share = [] (double across, double down) {
    return mirror_share (across, 1, 0) * mirror_share (down, 1, 0);
  };
  int seen = 0, mixed = 0;
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++) {
      const Position at = mapping.camera_at ({double (x), double (y)});
      const double px = std::round (at.x), py = std::round (at.y);
      if (px < 0 || py < 0 || px >= kSize.width || py >= kSize.height)
        continue;
      seen++;
      const Position nearest = mapping.mirror_at (px, py);
      mixed += share (nearest.x - x, nearest.y - y) < 0.6 * share (0, 0);
    }
  EXPECT_EQ (report.exact + report.weighted, std::uint64_t (seen));
  EXPECT_NEAR (double (report.mixed), mixed, 0.01 * mixed);
}

TEST (Rectifier, RefusesWhatItCannotDo)
{
  const auto outside = Rectifier::make (mapping_of ({}),
      schedule_of ("sequential:2x2,region=8x8+90+0:sequential:4x2"));
  ASSERT_FALSE (outside.ok ());
  EXPECT_NE (
      outside.error ().message.find ("region 0, 8x8+90+0"), std::string::npos);
  const Schedule schedule;
  const auto vast =
      Mapping::make ({.camera = {64, 48}, .mirrors = {16384, 16384}});
  ASSERT_TRUE (vast.ok ());
  const auto refused = Rectifier::make (*vast, schedule);
  ASSERT_FALSE (refused.ok ());
  EXPECT_EQ (refused.error ().message,
      "a mapping to 16384x16384 mirrors cannot be used for frames of 64x48 "
      "pixels, which see few of them; use the mapping of this bench");
  const auto large =
      Mapping::make ({.camera = {64, 48}, .mirrors = {2560, 1600}});
  EXPECT_TRUE (Rectifier::make (*large, schedule).ok ());
  const auto far = Rectifier::make (mapping_of ({5000, 0, 0, 1}), schedule);
  ASSERT_FALSE (far.ok ());
  EXPECT_NE (far.error ().message.find ("sees none of the mirrors"),
      std::string::npos);
  const auto small = Rectifier::make (mapping_of ({0, 0, 0, 0.5}), schedule);
  ASSERT_FALSE (small.ok ());
  EXPECT_EQ (small.error ().message, "a mapping with 0.500000 pixels per "
                                     "mirror cannot be corrected; use one of "
                                     "0.75 to 3.5");
}

/* What a stream's tag says of a bench must not cost minutes or gigabytes. */
TEST (Rectifier, RefusesWindowsThatTakeTooLong)
{
  const Schedule schedule;
  const auto error_of = [&] (const Mapping::Parts &parts) {
    const auto mapping = Mapping::make (parts);
    EXPECT_TRUE (mapping.ok ());
    const auto made = Rectifier::make (*mapping, schedule);
    return made.ok () ? std::string () : made.error ().message;
  };
  Mapping::Parts parts{kSize, kSize};
  parts.displacement = {2, 2, {0, 1e8, 0, 1e8}, {0, 0, 0, 0}};
  EXPECT_NE (error_of (parts).find ("mirrors to a pixel"), std::string::npos)
      << error_of (parts);
  /* Whole mirrors everywhere. */
  parts.displacement = {2, 2, {0, 95e6, 0, 95e6}, {0, 0, 0, 0}};
  EXPECT_NE (error_of (parts), "");
  parts.displacement = {};
  parts.homography[2] = 0.5;
  for (const double sigma : {8.0, 16.0}) {
    parts.psf_sigma = sigma;
    EXPECT_NE (error_of (parts).find ("blur of"), std::string::npos)
        << error_of (parts);
  }
  parts.psf_sigma = 2.0;
  EXPECT_EQ (error_of (parts), "");
  /* An aligned camera, too. */
  parts.homography[2] = 0.0;
  EXPECT_EQ (error_of (parts), "");
  parts.psf_sigma = 16.0;
  EXPECT_NE (error_of (parts).find ("focus the camera"), std::string::npos)
      << error_of (parts);
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames of two cameras that are of one exposure, or not, by their pixels. */
#include <map>

#include <gtest/gtest.h>

#include "sync/partner_watch.h"
#include "two_beams.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;
using namespace codedexposure::test::two_beams;
using Verdict = PartnerWatch::Verdict;

constexpr int kFrames = 16;
constexpr Extent kSize{160, 120};

struct Beams {
  Schedule schedule;
  Pictures on, off;
};

Beams
beams (const std::string &preset, double speed, const BenchOptions &first = {},
    BenchOptions second = {})
{
  const Schedule schedule = schedule_of (preset);
  const Pictures slots =
      moving_clouds (kSize, kFrames * schedule.slots (), speed);
  second.seed = first.seed + 1;
  return {schedule, coded (schedule, slots, first),
      coded (schedule.complement ().value (), slots, second)};
}

PartnerWatch::Camera
aligned (double black = 0.0)
{
  return {kSize, nullptr, black};
}

/* Verdicts on the pairs of frame i and partner i + @shift, without those at the
 * ends. */
std::map<Verdict, int>
verdicts (const Beams &beams, int shift, PartnerWatch watch)
{
  std::map<Verdict, int> count;
  for (int i = 0; i < kFrames; i++)
    if (i + shift >= 0 && i + shift < kFrames)
      count[watch.take (beams.on[std::size_t (i)].view (),
          beams.off[std::size_t (i + shift)].view ())]++;
  return count;
}

Verdict
take (PartnerWatch &watch, const Beams &beams, int on, int off)
{
  return watch.take (
      beams.on[std::size_t (on)].view (), beams.off[std::size_t (off)].view ());
}

/* Of partners: the first pair has nothing to be compared with. */
void
expect_good (std::map<Verdict, int> count, int unknown = 1)
{
  EXPECT_EQ (count[Verdict::bad], 0);
  EXPECT_LE (count[Verdict::unknown], unknown);
}

/* Of others: their partners must have come before. */
void
expect_bad (std::map<Verdict, int> count, int shift, int unknown = 0)
{
  EXPECT_EQ (count[Verdict::good], 0) << "by " << shift;
  EXPECT_LE (count[Verdict::unknown], unknown + std::abs (shift))
      << "by " << shift;
}

std::map<Verdict, int>
all_unknown (int shift)
{
  return {{Verdict::unknown, kFrames - std::abs (shift)}};
}

PartnerWatch
watch_of (const Beams &beams)
{
  return {beams.schedule, aligned (), aligned ()};
}

class PartnerWatchOf : public ::testing::TestWithParam<const char *>
{
};

TEST_P (PartnerWatchOf, KnowsPartnersAndOthersWhereTheSceneMoves)
{
  const Beams both = beams (GetParam (), 0.7);
  expect_good (verdicts (both, 0, watch_of (both)));
  for (const int shift : {-3, -2, -1, 1, 2, 3})
    expect_bad (verdicts (both, shift, watch_of (both)), shift);
}

INSTANTIATE_TEST_SUITE_P (Codes, PartnerWatchOf,
    ::testing::Values ("sequential:2x2", "sequential:lattice:4/2",
        "sequential:lattice:8/3,leak=0.01", "s-matrix:lattice:7/2",
        "sequential:4x4,pilot=8",
        "sequential:2x2,region=32x32+8+8:sequential:lattice:8/3"));

TEST (PartnerWatch, DoesNotKnowWhereNothingMoves)
{
  BenchOptions noisy;
  noisy.full_well = 10000.0;
  noisy.read_noise = 5.0;
  for (int seed = 0; seed < 10; seed++) {
    noisy.seed = std::uint64_t (2 * seed);
    const Beams both = beams (kPreset, 0.0, noisy, noisy);
    for (const int shift : {-1, 0, 1})
      EXPECT_EQ (verdicts (both, shift, watch_of (both)), all_unknown (shift));
  }
}

TEST (PartnerWatch, NoiseGainAndBlackLevelOfTheCamerasDoNotMatter)
{
  BenchOptions first;
  first.full_well = 10000.0;
  first.read_noise = 5.0;
  BenchOptions second = first;
  second.gain = 0.6;
  second.black_level = 24.0;
  const Beams both = beams (kPreset, 0.7, first, second);
  const PartnerWatch watch (both.schedule, aligned (), aligned (24.0));
  expect_good (verdicts (both, 0, watch));
  expect_bad (verdicts (both, 1, watch), 1);
  expect_bad (verdicts (both, -1, watch), -1);
}

TEST (PartnerWatch, TheSecondCameraMayHaveItsOwnPose)
{
  BenchOptions second;
  second.mapping = *Mapping::make ({.camera = kSize,
      .mirrors = kSize,
      .homography = {
          -1.02, 0.01, kSize.width + 1.4, 0.0, 1.02, 0.3, 0.0, 0.0, 1.0}});
  const Beams both = beams (kPreset, 0.7, {}, second);
  const PartnerWatch watch (
      both.schedule, aligned (), {kSize, &*second.mapping});
  /* A quarter of the mirrors has a pixel. */
  expect_good (verdicts (both, 0, watch), 4);
  expect_bad (verdicts (both, 1, watch), 1, 3);
  expect_bad (verdicts (both, -1, watch), -1, 3);
}

TEST (PartnerWatch, LearnsNothingFromSaturatedPixels)
{
  BenchOptions bright;
  bright.gain = 50.0;
  const Beams both = beams (kPreset, 0.7, bright, bright);
  EXPECT_EQ (verdicts (both, 1, watch_of (both)), all_unknown (1));
}

TEST (PartnerWatch, BeginsAnewAfterAReset)
{
  const Beams both = beams (kPreset, 0.7);
  PartnerWatch watch = watch_of (both);
  const auto take = [&] (std::size_t on, std::size_t off) {
    return watch.take (both.on[on].view (), both.off[off].view ());
  };
  take (0, 0);
  EXPECT_EQ (take (1, 1), Verdict::good);
  watch.reset ();
  EXPECT_EQ (take (3, 2), Verdict::unknown);
}

/* Its partner was lost, and times are others since. */
TEST (PartnerWatch, AFrameAloneIsComparedWith)
{
  const Beams seen = beams ("sequential:lattice:4/2", 0.7);
  const PartnerWatch::Camera camera = aligned ();
  struct Next {
    int on, off;
    Verdict verdict;
  };
  for (const auto &[on, off, verdict] :
      {Next{7, 6, Verdict::bad}, Next{7, 7, Verdict::good},
          Next{7, 8, Verdict::bad}, Next{7, 9, Verdict::bad}}) {
    PartnerWatch watch (seen.schedule, camera, camera);
    for (int i = 0; i < 6; i++)
      take (watch, seen, i, i);
    watch.take_alone (seen.on[6].view (), false);
    EXPECT_EQ (take (watch, seen, on, off), verdict) << "partner " << off;
  }
}

/* Nothing is known of a scene that does not move. */
TEST (PartnerWatch, AFrameAloneOfAStillSceneRefusesNone)
{
  const Beams seen = beams ("sequential:lattice:4/2", 0.0);
  const PartnerWatch::Camera camera = aligned ();
  PartnerWatch watch (seen.schedule, camera, camera);
  for (int i = 0; i < 6; i++)
    take (watch, seen, i, i);
  watch.take_alone (seen.off[6].view (), true);
  for (int i = 7; i < 10; i++)
    EXPECT_EQ (take (watch, seen, i, i), Verdict::unknown);
}

} // namespace

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Exposures between coded frames. */
#include <algorithm>
#include <numeric>

#include "fuse_scenes.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

FuseOptions
overlapping (FuseQuality quality, bool noisy = false)
{
  FuseOptions options = with_quality (quality, noisy);
  options.lookahead = 1;
  options.overlap = 2;
  return options;
}

FuseOptions
apart (FuseOptions options)
{
  options.overlap = 1;
  return options;
}

Image<std::uint8_t>
moving (double speed, int slot)
{
  return draw (
      96, 64, [&] (int x, int y) { return texture (x - speed * slot, y); });
}

const char *const kEight = "sequential:lattice:8/3,order=bit-reversal";

std::string
why_not (const char *preset, const FuseOptions &options)
{
  auto fuser =
      Fuser<std::uint8_t>::make (schedule_of (preset), 32, 32, options);
  EXPECT_TRUE (fuser) << fuser.error ().message;
  return fuser->unoverlapped ();
}

TEST (FuseOverlap, TheEndsOfAnExposureAreTruer)
{
  const Schedule schedule = schedule_of (kEight);
  const auto picture = [] (int slot) { return moving (2.0, slot); };
  const auto coded = take (schedule, 5, picture);
  const auto psnrs = [&] (const FuseOptions &options) {
    const auto frames = fuse (coded, schedule, options);
    std::vector<double> all;
    for (int slot = 16; slot < 24; slot++)
      all.push_back (psnr (frames[std::size_t (slot)], picture (slot)));
    return all;
  };
  const FuseOptions options = overlapping (FuseQuality::kBalanced);
  const auto both = psnrs (options), alone = psnrs (apart (options));
  EXPECT_GT (both.front (), alone.front () + 0.3);
  EXPECT_GT (both.back (), alone.back () + 0.3);
  EXPECT_GT (std::accumulate (both.begin (), both.end (), 0.0),
      std::accumulate (alone.begin (), alone.end (), 0.0));
}

TEST (FuseOverlap, PixelsStayAsTheyWereInTheirOwnSlot)
{
  for (const char *preset :
      {"sequential:lattice:5/2", "sequential:lattice:2/1"}) {
    const Schedule schedule = schedule_of (preset);
    const auto coded =
        take (schedule, 4, [] (int slot) { return moving (2.0, slot); });
    for (const FuseQuality quality :
        {FuseQuality::kFast, FuseQuality::kLearned}) {
      const auto frames = fuse (coded, schedule, overlapping (quality));
      for (std::size_t f = 0; f < coded.size (); f++)
        for (int y = 0; y < 64; y++)
          for (int x = 0; x < 96; x++)
            ASSERT_EQ (frames[f * std::size_t (schedule.slots ()) +
                              std::size_t (schedule.element_at (x, y))]
                           .at (x, y),
                coded[f].at (x, y))
                << preset << ", " << quality_name (quality);
    }
  }
}

/* Nothing is before the first frame and after the last one. */
TEST (FuseOverlap, TheEndsOfAStreamAreThoseOfItsFramesAlone)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto coded =
      take (schedule, 3, [] (int slot) { return moving (1.0, slot); });
  const FuseOptions options = overlapping (FuseQuality::kFast);
  const auto both = fuse (coded, schedule, options);
  const auto alone = fuse (coded, schedule, apart (options));
  for (const std::size_t slot : {0u, 1u, 10u, 11u})
    EXPECT_TRUE (both[slot] == alone[slot]) << slot;
  for (std::size_t slot = 2; slot < 10; slot++)
    EXPECT_FALSE (both[slot] == alone[slot]) << slot;
}

TEST (FuseOverlap, StillLightIsThatOfTheFrames)
{
  const auto scene = draw (64, 48, texture);
  const Schedule schedule = schedule_of (kEight);
  for (const bool noisy : {false, true}) {
    const auto coded = take (
        schedule, 6, [&] (int) { return scene; },
        noisy ? noisy_bench () : BenchOptions ());
    const FuseOptions options = overlapping (FuseQuality::kFast, noisy);
    const auto both = fuse (coded, schedule, options);
    const auto alone = fuse (coded, schedule, apart (options));
    for (std::size_t slot = 24; slot < 32; slot++)
      EXPECT_GT (psnr (both[slot], alone[slot]), noisy ? 55.0 : 90.0)
          << noisy << ' ' << slot;
  }
}

TEST (FuseOverlap, RegionsHaveTheirOwn)
{
  const Schedule schedule = schedule_of (
      "sequential:lattice:4/2,region=32x32+32+16:sequential:lattice:2/1");
  const auto picture = [] (int slot) { return moving (1.0, slot); };
  const auto coded = take (schedule, 4, picture);
  const FuseOptions options = overlapping (FuseQuality::kBalanced);
  const auto both = fuse (coded, schedule, options);
  const auto alone = fuse (coded, schedule, apart (options));
  double gain = 0.0;
  for (std::size_t slot = 4; slot < 12; slot++) {
    EXPECT_FALSE (both[slot] == alone[slot]) << slot;
    gain += psnr (both[slot], picture (int (slot))) -
            psnr (alone[slot], picture (int (slot)));
  }
  EXPECT_GT (gain, 0.0);
  for (std::size_t slot = 4; slot < 12; slot += 2)
    for (int y = 16; y < 48; y++)
      for (int x = 32; x < 64; x++)
        ASSERT_EQ (both[slot].at (x, y), both[slot + 1].at (x, y)) << slot;
}

/* What is said of the frames holds everywhere in them. */
TEST (FuseOverlap, WhereARegionCannotNothingDoes)
{
  const char *preset =
      "sequential:lattice:4/2,region=32x32+32+16:staircase:lattice:2/1";
  const Schedule schedule = schedule_of (preset);
  const auto coded =
      take (schedule, 3, [] (int slot) { return moving (1.0, slot); });
  const FuseOptions options = overlapping (FuseQuality::kFast);
  EXPECT_TRUE (fuse (coded, schedule, options) ==
               fuse (coded, schedule, apart (options)));
  EXPECT_NE (Fuser<std::uint8_t>::make (schedule, 96, 64, options)
                 ->unoverlapped ()
                 .find ("staircase:lattice:2/1"),
      std::string::npos);
}

TEST (FuseOverlap, SaysHowUncertainBothAreTogether)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto coded =
      take (schedule, 3, [] (int slot) { return moving (1.0, slot); });
  const auto of_second = [&] (const FuseOptions &options) {
    auto fuser = Fuser<std::uint8_t>::make (schedule, 96, 64, options);
    EXPECT_TRUE (fuser);
    Pictures<> frames (4, Image<std::uint8_t> (96, 64));
    Pictures<std::uint16_t> deviations (4, Image<std::uint16_t> (96, 64));
    std::vector<ImageView<std::uint8_t>> views;
    std::vector<ImageView<std::uint16_t>> of_views;
    for (std::size_t s = 0; s < 4; s++) {
      views.push_back (frames[s].view ());
      of_views.push_back (deviations[s].view ());
    }
    for (const auto &frame : coded)
      EXPECT_TRUE (fuser->take (frame.view ()));
    for (int i = 0; i < 2; i++)
      EXPECT_TRUE (fuser->fuse (views, {}, of_views));
    return deviations;
  };
  const FuseOptions options = overlapping (FuseQuality::kBalanced);
  const auto both = of_second (options), alone = of_second (apart (options));
  for (std::size_t s = 0; s < 4; s++) {
    double sum = 0.0, of_alone = 0.0;
    for (int y = 0; y < 64; y++)
      for (int x = 0; x < 96; x++) {
        sum += both[s].at (x, y);
        of_alone += alone[s].at (x, y);
      }
    EXPECT_FALSE (both[s] == alone[s]);
    EXPECT_NEAR (sum, of_alone, 0.2 * of_alone) << s;
  }
}

TEST (FuseOverlap, SaysWhyThereIsNone)
{
  const FuseOptions options = overlapping (FuseQuality::kFast);
  EXPECT_EQ (why_not ("sequential:2x2", options), "");
  EXPECT_EQ (why_not ("staircase:2x2", apart (options)), "");
  EXPECT_NE (why_not ("staircase:2x2", options).find ("more than one slot"),
      std::string::npos);
  EXPECT_EQ (why_not ("sequential:2x2,leak=0.01", options), "");
  EXPECT_NE (why_not ("sequential:2x2,leak=0.02", options)
                 .find ("pass 2 % of the light"),
      std::string::npos);
  FuseOptions pairs = options;
  pairs.partner = true;
  EXPECT_NE (why_not ("sequential:2x2", pairs).find ("second camera"),
      std::string::npos);
  FuseOptions live = options;
  live.lookahead = 0;
  const auto refused =
      Fuser<std::uint8_t>::make (schedule_of ("sequential:2x2"), 8, 8, live);
  ASSERT_FALSE (refused);
  EXPECT_NE (
      refused.error ().message.find ("set lookahead to 1"), std::string::npos);
  live.overlap = 9;
  EXPECT_EQ (
      Fuser<std::uint8_t>::make (schedule_of ("sequential:2x2"), 8, 8, live)
          .error ()
          .message,
      "overlap 9: 1 to 8 exposures are fused for each coded frame");
}

TEST (FuseOverlap, BeginsAnewAfterAStop)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto coded =
      take (schedule, 3, [] (int slot) { return moving (1.0, slot); });
  const FuseOptions options = overlapping (FuseQuality::kBalanced);
  auto fuser = Fuser<std::uint8_t>::make (schedule, 96, 64, options);
  ASSERT_TRUE (fuser);
  Pictures<> frames (4, Image<std::uint8_t> (96, 64));
  std::vector<ImageView<std::uint8_t>> views;
  for (auto &frame : frames)
    views.push_back (frame.view ());
  for (int round = 0; round < 2; round++) {
    ASSERT_TRUE (fuser->take (coded[0].view ()));
    ASSERT_TRUE (fuser->take (coded[1].view ()));
    std::stop_source stop;
    if (round == 0)
      stop.request_stop ();
    const auto done = fuser->fuse (views, stop.get_token ());
    EXPECT_EQ (bool (done), round == 1);
  }
  const auto whole = fuse (coded, schedule, options);
  for (std::size_t s = 0; s < 4; s++)
    EXPECT_TRUE (frames[s] == whole[s]) << s;
}

} // namespace

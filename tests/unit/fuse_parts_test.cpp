/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A part of a stream is fused as in the whole. */
#include <algorithm>
#include <cmath>

#include "fuse_scenes.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

/* The frames of @coded from @from to @to, fused apart from all but those on
 * which they can depend. */
template <typename Pixel>
Pictures<Pixel>
fuse_part (const Pictures<Pixel> &coded, std::size_t from, std::size_t to,
    const Schedule &schedule, const FuseOptions &options, std::size_t history)
{
  const std::size_t first = from - std::min (from, history);
  const std::size_t end =
      std::min (to + std::size_t (options.lookahead), coded.size ());
  const auto frames = fuse<Pixel> ({coded.begin () + std::ptrdiff_t (first),
                                       coded.begin () + std::ptrdiff_t (end)},
      schedule, options, from - first);
  return {frames.begin (),
      frames.begin () +
          std::ptrdiff_t ((to - from) * std::size_t (schedule.slots ()))};
}

template <typename Pixel>
void
expect_parts_as_whole (const Pictures<Pixel> &coded, const Schedule &schedule,
    const FuseOptions &options, std::initializer_list<std::size_t> lengths)
{
  const auto fuser = Fuser<Pixel>::make (
      schedule, coded[0].width (), coded[0].height (), options);
  ASSERT_TRUE (fuser) << fuser.error ().message;
  const auto history = std::size_t (fuser->history ());
  const auto whole = fuse (coded, schedule, options);
  for (const std::size_t length : lengths) {
    Pictures<Pixel> joined;
    for (std::size_t from = 0; from < coded.size (); from += length)
      std::ranges::move (
          fuse_part (coded, from, std::min (from + length, coded.size ()),
              schedule, options, history),
          std::back_inserter (joined));
    EXPECT_TRUE (joined == whole)
        << quality_name (options.quality) << ", parts of " << length
        << ", lookahead " << options.lookahead << ", overlap "
        << options.overlap << ", full well " << options.noise.full_well;
  }
}

/* A dim disc on still texture under light that drifts: many pixels are between
 * static and moving. */
TEST (Fuse, APartWithItsHistoryIsFusedAsInTheWhole)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto picture = [] (int slot) {
    return draw (48, 32, [slot] (int x, int y) {
      const double away = std::hypot (x - 0.4 * slot, y - 16);
      return (0.5 + 0.0006 * slot) * texture (x, y) + (away < 5.0 ? 0.06 : 0.0);
    });
  };
  const auto coded = take (schedule, 40, picture, noisy_bench ());
  for (const bool noisy : {false, true})
    for (const int lookahead : {0, 1}) {
      FuseOptions options = with_quality (FuseQuality::kFast, noisy);
      options.lookahead = lookahead;
      expect_parts_as_whole (coded, schedule, options, {1, 7, 17});
      options.quality = FuseQuality::kBest;
      options.threads = 1;
      const Pictures<> some (coded.begin (), coded.begin () + 20);
      expect_parts_as_whole (some, schedule, options, {19});
    }
}

TEST (Fuse, APartThatOverlapsIsFusedAsInTheWhole)
{
  const Schedule schedule = schedule_of ("sequential:lattice:4/2");
  const auto picture = [] (int slot) {
    return draw (48, 32, [slot] (int x, int y) {
      return (0.5 + 0.0006 * slot) * texture (x - slot / 3, y);
    });
  };
  const auto coded = take (schedule, 40, picture, noisy_bench ());
  for (const bool noisy : {false, true}) {
    FuseOptions options = with_quality (FuseQuality::kFast, noisy);
    options.lookahead = 1;
    options.overlap = 3;
    expect_parts_as_whole (coded, schedule, options, {3, 19});
    options.refine = true;
    const Pictures<> some (coded.begin (), coded.begin () + 6);
    expect_parts_as_whole (some, schedule, options, {4});
  }
}

TEST (Fuse, APartOfSixteenBitsIsFusedAsInTheWhole)
{
  const Schedule schedule = schedule_of ("staircase:2x2");
  const auto scene = [] (int slot) {
    return draw<std::uint16_t> (48, 32, [slot] (int x, int y) {
      return (0.9 - 0.001 * slot) * texture (x, y);
    });
  };
  FuseOptions options = with_quality (FuseQuality::kFast, true);
  options.lookahead = 1;
  expect_parts_as_whole (
      take<std::uint16_t> (schedule, 40, scene, noisy_bench ()), schedule,
      options, {1, 7});
}

} // namespace

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rectified frames, corrected by light that is known. */
#include <utility>
#include <vector>

#include "misaligned.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test::misaligned;

/* As far as a mirror's pixels reach from the border, frames stay as they are.
 */
TEST (Rectifier, TakesOffWhatItMakesWrongOfKnownLight)
{
  const Alignment between{.shift_x = 0.45, .shift_y = -0.4, .rotation = 0.2};
  const Schedule schedule =
      schedule_of ("sequential:2x2,region=24x24+32+16:sequential:4x2");
  const Mapping mapping = mapping_of (between, 0.3);
  const Rectifier rectifier =
      *Rectifier::make (mapping, schedule, {.correct = true});
  ASSERT_TRUE (rectifier.corrects ());
  const auto truth = coded ({}, schedule);
  const auto before = rectified (rectifier, coded (between, schedule, 0.3));
  Workers one (1), three (3);
  std::vector<Image<std::uint8_t>> corrected;
  for (const int unit : {257, 60, 5})
    for (Workers *workers : {&one, &three}) {
      Image<std::uint16_t> known (kSize.width, kSize.height - 6);
      for (int y = 0; y < known.height (); y++)
        for (int x = 0; x < known.width (); x++)
          known.at (x, y) = std::uint16_t (unit * truth.at (x, y));
      corrected.push_back (before);
      const auto done = rectifier.correct (
          corrected.back ().view (), std::as_const (known).view (), *workers);
      ASSERT_TRUE (done) << done.error ().message;
    }
  for (std::size_t i = 0; i < corrected.size (); i += 2)
    EXPECT_EQ (rms (corrected[i], corrected[i + 1], 0), 0.0);
  EXPECT_GT (rms (before, truth, 16), 4.0);
  for (const auto &frame : corrected)
    EXPECT_LT (rms (frame, truth, 16), 0.15 * rms (before, truth, 16));
  for (int x = 0; x < kSize.width; x++)
    EXPECT_EQ (corrected[0].at (x, 4), before.at (x, 4));
}

TEST (Rectifier, WhatIsSaturatedIsNotCorrected)
{
  const Alignment between{.shift_x = 0.5, .shift_y = 0.5};
  const Schedule schedule = schedule_of ("sequential:2x2");
  const Rectifier rectifier = *Rectifier::make (
      mapping_of (between), schedule, {.keep_unknown = true, .correct = true});
  auto frame = coded (between, schedule);
  frame.at (40, 30) = 200;
  Image<std::uint8_t> mirrors (kSize.width, kSize.height);
  ASSERT_TRUE (rectifier.run (frame.view (), mirrors.view (), 200));
  const auto before = mirrors;
  Image<std::uint16_t> bright (kSize.width, kSize.height);
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++)
      bright.at (x, y) = std::uint16_t ((x + y) % 2 * 60000);
  Workers workers (1);
  ASSERT_TRUE (rectifier.correct (
      mirrors.view (), std::as_const (bright).view (), workers, 200));
  int saturated = 0, changed = 0;
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++) {
      EXPECT_EQ (mirrors.at (x, y) == 200, before.at (x, y) == 200);
      saturated += mirrors.at (x, y) == 200;
      changed += mirrors.at (x, y) != before.at (x, y);
    }
  EXPECT_GE (saturated, 25);
  EXPECT_GT (changed, 1000);
}

TEST (Rectifier, CorrectsOnlyWhereItPays)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  const auto corrects = [&] (const Alignment &alignment, bool wanted) {
    return Rectifier::make (
        mapping_of (alignment, 0.3), schedule, {.correct = wanted})
        ->corrects ();
  };
  EXPECT_TRUE (corrects ({.shift_x = 0.5}, true));
  EXPECT_FALSE (corrects ({.shift_x = 0.5}, false));
  EXPECT_FALSE (corrects ({.shift_x = 0.1}, true));
  const Rectifier without = made (mapping_of ({.shift_x = 0.5}), schedule);
  Image<std::uint8_t> mirrors (kSize.width, kSize.height);
  Image<std::uint16_t> light (kSize.width, kSize.height), wide (97, 64);
  Workers workers (1);
  EXPECT_FALSE (without.correct (
      mirrors.view (), std::as_const (light).view (), workers));
  const Rectifier with = *Rectifier::make (
      mapping_of ({.shift_x = 0.5}), schedule, {.correct = true});
  EXPECT_FALSE (
      with.correct (mirrors.view (), std::as_const (wide).view (), workers));
  /* Of no light, nothing is known. */
  EXPECT_TRUE (
      with.correct (mirrors.view (), std::as_const (light).view (), workers));
}

} // namespace

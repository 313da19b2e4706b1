/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frame numbers from frame times. */
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "sync/frame_sequence.h"

using namespace codedexposure;

namespace
{

constexpr Nanoseconds kMs = 1'000'000;

struct Expected {
  Nanoseconds time;
  Arrival arrival;
  std::uint64_t number;
  std::uint64_t lost;
};

void
expect_steps (FrameSequence &sequence, const std::vector<Expected> &frames,
    bool reverse = false)
{
  for (const Expected &frame : frames) {
    SCOPED_TRACE (frame.time);
    const FrameStep step = sequence.take (frame.time, reverse);
    EXPECT_EQ (step.arrival, frame.arrival);
    EXPECT_EQ (step.number, frame.number);
    EXPECT_EQ (step.lost, frame.lost);
  }
}

} // namespace

TEST (FrameSequence, NumbersEveryFrameOfAnHourExactly)
{
  for (const FrameRate rate : {FrameRate{25, 1}, FrameRate{30000, 1001}}) {
    FrameSequence sequence (rate);
    const std::int64_t frames = 3600LL * rate.num / rate.den;
    for (std::int64_t k = 0; k < frames; k++) {
      const FrameStep step = sequence.take (rate.time_of (k));
      ASSERT_EQ (step.arrival, k == 0 ? Arrival::first : Arrival::next);
      ASSERT_EQ (step.number, std::uint64_t (k));
    }
  }
}

TEST (FrameSequence, AStepOfMoreThanOneAndAHalfPeriodsIsALoss)
{
  FrameSequence sequence ({25, 1});
  expect_steps (
      sequence, {{0, Arrival::first, 0, 0}, {60 * kMs, Arrival::next, 1, 0},
                    {120 * kMs + 1, Arrival::after_loss, 3, 1},
                    {200 * kMs, Arrival::after_loss, 5, 1},
                    {1200 * kMs, Arrival::after_loss, 30, 24},
                    {1240 * kMs, Arrival::next, 31, 0}});
}

/* The frame after one that was only late is too close to it: the numbers are
 * right again, and what was counted as lost has come. */
TEST (FrameSequence, ALossThatTheNextFrameDisprovesIsRevoked)
{
  FrameSequence sequence ({25, 1});
  expect_steps (sequence,
      {{0, Arrival::first, 0, 0}, {40 * kMs, Arrival::next, 1, 0},
          {80 * kMs, Arrival::next, 2, 0},
          {144'500'000, Arrival::after_loss, 4, 1},
          {160 * kMs, Arrival::late, 3, 0}, {200 * kMs, Arrival::next, 5, 0},
          {240 * kMs, Arrival::next, 6, 0}});
  /* Of several, one. */
  expect_steps (sequence,
      {{384'500'000, Arrival::after_loss, 10, 3},
          {400 * kMs, Arrival::late, 9, 0}, {440 * kMs, Arrival::next, 11, 0}});
  /* A loss is a loss, whatever the jitter of the next frame. */
  expect_steps (sequence, {{525 * kMs, Arrival::after_loss, 13, 1},
                              {553 * kMs, Arrival::next, 14, 0},
                              {600 * kMs, Arrival::next, 15, 0}});
}

TEST (FrameSequence, CountsLossesExactlyOverALongGap)
{
  const FrameRate rate{30000, 1001};
  FrameSequence sequence (rate);
  sequence.take (0);
  const FrameStep step = sequence.take (rate.time_of (100'000));
  EXPECT_EQ (step.number, 100'000u);
  EXPECT_EQ (step.lost, 99'999u);
}

TEST (FrameSequence, JitterOfAnEighthIsNotALoss)
{
  FrameSequence sequence ({25, 1});
  for (int k = 0; k < 1000; k++) {
    const Nanoseconds jitter = (k * 7919 % 11 - 5) * kMs;
    const FrameStep step = sequence.take (k * 40 * kMs + jitter);
    ASSERT_EQ (step.number, std::uint64_t (k));
    ASSERT_EQ (step.lost, 0u);
  }
}

TEST (FrameSequence, TheSameTimeAgainIsADuplicate)
{
  FrameSequence sequence ({25, 1});
  expect_steps (
      sequence, {{0, Arrival::first, 0, 0}, {40 * kMs, Arrival::next, 1, 0},
                    {40 * kMs, Arrival::duplicate, 1, 0},
                    {49 * kMs, Arrival::duplicate, 1, 0},
                    {80 * kMs, Arrival::next, 2, 0}});
}

TEST (FrameSequence, ALateFrameHasTheNumberThatWasCountedAsLost)
{
  FrameSequence sequence ({25, 1});
  expect_steps (sequence,
      {{0, Arrival::first, 0, 0}, {80 * kMs, Arrival::after_loss, 2, 1},
          {40 * kMs, Arrival::late, 1, 0}, {120 * kMs, Arrival::next, 3, 0}});
}

TEST (FrameSequence, TimeThatBeginsAnewIsFollowed)
{
  FrameSequence sequence ({25, 1});
  expect_steps (sequence,
      {{400 * kMs, Arrival::first, 0, 0}, {440 * kMs, Arrival::next, 1, 0},
          {0, Arrival::behind, 0, 0}, {40 * kMs, Arrival::restarted, 2, 0},
          {80 * kMs, Arrival::next, 3, 0}});

  FrameSequence far ({25, 1});
  expect_steps (
      far, {{5000 * kMs, Arrival::first, 0, 0}, {0, Arrival::restarted, 1, 0},
               {40 * kMs, Arrival::next, 2, 0}});
}

TEST (FrameSequence, RunsBackwardWhenToldTo)
{
  FrameSequence sequence ({25, 1});
  expect_steps (sequence,
      {{400 * kMs, Arrival::first, 0, 0}, {360 * kMs, Arrival::next, 1, 0},
          {240 * kMs, Arrival::after_loss, 4, 2},
          {280 * kMs, Arrival::late, 3, 0}},
      true);
}

TEST (FrameSequence, ResyncKeepsTheNumbersAndExpectsNothing)
{
  FrameSequence sequence ({25, 1});
  expect_steps (
      sequence, {{0, Arrival::first, 0, 0}, {40 * kMs, Arrival::next, 1, 0}});
  sequence.resync ();
  expect_steps (sequence,
      {{9000 * kMs, Arrival::first, 2, 0}, {9040 * kMs, Arrival::next, 3, 0}});
}

TEST (FrameSequence, FollowsACameraThatWasAway)
{
  FrameSequence sequence ({25, 1});
  expect_steps (
      sequence, {{0, Arrival::first, 0, 0}, {40 * kMs, Arrival::next, 1, 0}});
  const FrameStep back = sequence.take_after (7, 51 * 40 * kMs - 3 * kMs);
  EXPECT_EQ (back.arrival, Arrival::after_loss);
  EXPECT_EQ (back.number, 52u);
  EXPECT_EQ (back.lost, 50u);
  expect_steps (sequence, {{40 * kMs + 7, Arrival::next, 53, 0}});
  EXPECT_EQ (sequence.take_after (1, 30 * kMs).arrival, Arrival::next);
}

TEST (FrameSequence, TwoFramesOfARestartAreNotWithinOneExposure)
{
  FrameSequence sequence ({25, 1});
  expect_steps (
      sequence, {{0, Arrival::first, 0, 0}, {40 * kMs, Arrival::next, 1, 0}});
  const FrameStep close = sequence.take_after (7000 * kMs, 20 * kMs);
  EXPECT_EQ (close.arrival, Arrival::duplicate);
  EXPECT_EQ (close.number, 1u);
  expect_steps (sequence, {{7040 * kMs, Arrival::next, 2, 0}});
}

TEST (FrameSequence, NoNumberIsGivenTwice)
{
  for (const int back : {1, 2, 5, 20}) {
    SCOPED_TRACE (back);
    FrameSequence sequence ({25, 1});
    std::set<std::uint64_t> given;
    Nanoseconds time = 0;
    const auto take = [&] {
      const FrameStep step = sequence.take (time);
      if (step.arrival != Arrival::behind &&
          step.arrival != Arrival::duplicate) {
        EXPECT_TRUE (given.insert (step.number).second) << step.number;
      }
      time += 40 * kMs;
    };
    for (int k = 0; k < 60; k++) {
      if (k == 30)
        time -= (back + 1) * 40 * kMs;
      take ();
    }
    EXPECT_GE (given.size (), 58u);
    EXPECT_EQ (*given.rbegin (), given.size () - 1);
  }
}

TEST (FrameSequence, ALateFrameComesOnce)
{
  FrameSequence sequence ({25, 1});
  expect_steps (sequence,
      {{0, Arrival::first, 0, 0}, {120 * kMs, Arrival::after_loss, 3, 2},
          {40 * kMs, Arrival::late, 1, 0}, {160 * kMs, Arrival::next, 4, 0},
          {40 * kMs, Arrival::behind, 1, 0}, {200 * kMs, Arrival::next, 5, 0},
          {80 * kMs, Arrival::late, 2, 0}});
}

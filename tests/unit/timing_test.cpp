/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frame times, slots in a frame period, and the text of times. */
#include "schedule/timing.h"

#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

using namespace codedexposure;

namespace
{

__extension__ typedef __int128 Wide;

constexpr Nanoseconds kMs = 1'000'000;
constexpr FrameRate kRates[] = {{25, 1}, {30000, 1001}, {24000, 1001}};

/** t is the largest integer that is not above (index + part / parts) / rate
 * seconds. */
bool
is_floor (
    Nanoseconds t, FrameRate rate, std::int64_t index, int part, int parts)
{
  const Wide exact = (Wide (index) * parts + part) * rate.den * 1'000'000'000;
  const Wide unit = Wide (rate.num) * parts;
  return t * unit <= exact && exact < (t + 1) * unit;
}

void
expect_words (const std::string &message, const std::vector<std::string> &words)
{
  for (const std::string &word : words)
    EXPECT_NE (message.find (word), std::string::npos)
        << "'" << word << "' in: " << message;
}

} // namespace

TEST (FrameRate, FollowsFromAPeriodInNanoseconds)
{
  for (const FrameRate rate : {FrameRate{25, 1}, {249, 10}, {2499, 100},
           {30000, 1001}, {24000, 1001}, {1000, 33}, {1, 3600}, {10000, 1}})
    EXPECT_EQ (FrameRate::of_period (rate.period ()), rate) << rate.num;
  std::mt19937 random (1);
  std::uniform_int_distribution<Nanoseconds> any (2, 2'000'000'000);
  for (int i = 0; i < 10'000; i++) {
    const Nanoseconds period = any (random);
    const auto rate = FrameRate::of_period (period);
    ASSERT_TRUE (rate) << period;
    EXPECT_LE (std::abs (rate->period () - period), 1) << period;
  }
  for (const Nanoseconds period : {0, 1, -5})
    EXPECT_FALSE (FrameRate::of_period (period)) << period;
  EXPECT_FALSE (FrameRate::of_period (Nanoseconds (1) << 61));
}

TEST (FrameRate, KnownTimes)
{
  EXPECT_EQ ((FrameRate{25, 1}.time_of (1)), 40 * kMs);
  EXPECT_EQ ((FrameRate{25, 1}.time_of (7, 3, 4)), 310 * kMs);
  EXPECT_EQ ((FrameRate{30000, 1001}.time_of (1)), 33'366'666);
  EXPECT_EQ ((FrameRate{30000, 1001}.time_of (2)), 66'733'333);
  EXPECT_EQ ((FrameRate{30000, 1001}.time_of (3)), 100'100'000);
  EXPECT_EQ ((FrameRate{30000, 1001}.time_of (0, 1, 4)), 8'341'666);
  EXPECT_EQ ((FrameRate{30000, 1001}.time_of (30000)), 1001'000'000'000);
  EXPECT_EQ ((FrameRate{24000, 1001}.period ()), 41'708'333);
}

TEST (FrameRate, TimesAreExactFloorsOverTenHours)
{
  for (const FrameRate rate : kRates) {
    const std::int64_t frames = 36000LL * rate.num / rate.den;
    for (const int parts : {4, 7}) {
      Nanoseconds before = -1;
      for (std::int64_t index = 0; index < frames; index += 1 + parts % 4 * 8) {
        for (int part = 0; part < parts; part++) {
          const Nanoseconds t = rate.time_of (index, part, parts);
          ASSERT_TRUE (is_floor (t, rate, index, part, parts))
              << index << " + " << part << "/" << parts;
          ASSERT_GT (t, before);
          before = t;
        }
        ASSERT_EQ (
            rate.time_of (index, parts, parts), rate.time_of (index + 1));
      }
    }
  }
}

TEST (FrameRate, TimesOfACenturyDoNotOverflow)
{
  const FrameRate rate{30000, 1001};
  const std::int64_t index = 30000LL * 3'000'000;
  EXPECT_EQ (rate.time_of (index), 1001LL * 3'000'000 * 1'000'000'000);
}

TEST (SlotPlan, BenchOfThePaperFitsTwentyFiveFrames)
{
  const Timing bench{9800 * 1000, 200 * 1000, 0};
  const auto plan = SlotPlan::fit (bench, 4, {25, 1});
  ASSERT_TRUE (plan.ok ()) << plan.error ().message;
  EXPECT_EQ (plan->slots (), 4);
  EXPECT_EQ (plan->frame_period (), 40 * kMs);
  EXPECT_EQ (plan->active (), 9800 * 1000);
  for (int slot = 0; slot < 4; slot++)
    EXPECT_EQ (plan->start (slot), slot * 10 * kMs);
  EXPECT_EQ (plan->exposure (), 39'800 * 1000);
}

TEST (SlotPlan, BenchOfThePaperDoesNotFitTwentySix)
{
  const auto plan = SlotPlan::fit ({9800 * 1000, 200 * 1000, 0}, 4, {26, 1});
  ASSERT_FALSE (plan.ok ());
  expect_words (plan.error ().message,
      {"4 slots", "9.8ms", "200us", "need 40ms", "26/1", "38.461538ms",
          "shorten active", "lower the frame rate"});
}

TEST (SlotPlan, OneNanosecondTooMuchDoesNotFit)
{
  for (const FrameRate rate : kRates) {
    const Nanoseconds period = rate.period ();
    const Timing full{period / 4 - 1000, 1000, period % 4};
    EXPECT_TRUE (SlotPlan::fit (full, 4, rate).ok ());
    Timing over = full;
    over.readout++;
    EXPECT_FALSE (SlotPlan::fit (over, 4, rate).ok ());
  }
}

TEST (SlotPlan, EqualSlotsTileThePeriod)
{
  for (const FrameRate rate : kRates) {
    for (const int slots : {2, 3, 4, 7, 16, 256}) {
      const auto plan = SlotPlan::fit ({}, slots, rate);
      ASSERT_TRUE (plan.ok ());
      EXPECT_EQ (plan->start (0), 0);
      EXPECT_EQ (plan->start (slots), rate.period ());
      for (int slot = 0; slot < slots; slot++) {
        const Nanoseconds length = plan->start (slot + 1) - plan->start (slot);
        EXPECT_GE (length, plan->active ());
        EXPECT_LE (length, plan->active () + 1);
      }
      EXPECT_LE (plan->exposure (), rate.period ());
    }
  }
}

TEST (SlotPlan, SwitchingAndReadoutAreTakenFromTheLight)
{
  const auto plan = SlotPlan::fit ({0, 200 * 1000, 4 * kMs}, 4, {25, 1});
  ASSERT_TRUE (plan.ok ());
  EXPECT_EQ (plan->active (), 8'800 * 1000);
  EXPECT_EQ (plan->start (3), 27 * kMs);
  EXPECT_EQ (plan->exposure (), 35'800 * 1000);
}

TEST (SlotPlan, NothingLeftForLightIsAnError)
{
  const auto plan = SlotPlan::fit ({0, 200 * 1000, 0}, 256, {25, 1});
  ASSERT_FALSE (plan.ok ());
  expect_words (
      plan.error ().message, {"256 slots", "200us", "no time for light", "25/1",
                                 "40ms", "fewer slots"});
  EXPECT_FALSE (SlotPlan::fit ({0, 0, 40 * kMs}, 4, {25, 1}).ok ());
  EXPECT_FALSE (SlotPlan::fit ({0, 0, 50 * kMs}, 4, {25, 1}).ok ());
}

TEST (SlotPlan, AFrameRateIsNeeded)
{
  for (const FrameRate rate : {FrameRate{0, 1}, FrameRate{25, 0}}) {
    const auto plan = SlotPlan::fit ({}, 4, rate);
    ASSERT_FALSE (plan.ok ());
    expect_words (plan.error ().message, {"frame rate", "above 0"});
  }
}

TEST (TimeText, Parses)
{
  const struct {
    const char *text;
    Nanoseconds time;
  } cases[] = {
      {"0", 0},
      {"0ms", 0},
      {"1ns", 1},
      {"105000ns", 105'000},
      {"200us", 200'000},
      {"0.2ms", 200'000},
      {"9.8ms", 9'800'000},
      {"0.04s", 40'000'000},
      {"33.366666ms", 33'366'666},
      {"0.000000001s", 1},
      {"1.50000000000000000000s", 1'500'000'000},
      {"007us", 7'000},
      {"3599.999999999s", kTimeLimit - 1},
  };
  for (const auto &c : cases) {
    const auto time = parse_time (c.text);
    ASSERT_TRUE (time.ok ()) << c.text << ": " << time.error ().message;
    EXPECT_EQ (*time, c.time) << c.text;
  }
}

TEST (TimeText, WrongTextsAreNamed)
{
  const struct {
    std::string text;
    const char *word;
  } cases[] = {
      {"", "number with a unit"},
      {"ms", "number with a unit"},
      {"5", "number with a unit"},
      {"1.5", "number with a unit"},
      {"00", "number with a unit"},
      {"1.ms", "number with a unit"},
      {".5ms", "number with a unit"},
      {"-1ms", "number with a unit"},
      {"+1ms", "number with a unit"},
      {"1 ms", "number with a unit"},
      {" 1ms", "number with a unit"},
      {"1ms ", "number with a unit"},
      {"1MS", "number with a unit"},
      {"1m", "number with a unit"},
      {"1min", "number with a unit"},
      {"1e3ms", "number with a unit"},
      {"0x1ms", "number with a unit"},
      {"nanms", "number with a unit"},
      {"infs", "number with a unit"},
      {"1,5ms", "number with a unit"},
      {"1..5ms", "number with a unit"},
      {"3600s", "below an hour"},
      {"99999999999999999999999ns", "below an hour"},
      {"0.5ns", "finer than a nanosecond"},
      {"0.0000000001s", "finer than a nanosecond"},
      {std::string ("1\0ms", 4), "\\x00"},
  };
  for (const auto &c : cases) {
    const auto time = parse_time (c.text);
    ASSERT_FALSE (time.ok ()) << c.text;
    expect_words (time.error ().message, {c.word});
  }
  expect_words (parse_time ("12parsec").error ().message, {"'12parsec'"});
}

TEST (TimeText, IsShortest)
{
  EXPECT_EQ (time_text (0), "0");
  EXPECT_EQ (time_text (1), "1ns");
  EXPECT_EQ (time_text (999), "999ns");
  EXPECT_EQ (time_text (1000), "1us");
  EXPECT_EQ (time_text (200'000), "200us");
  EXPECT_EQ (time_text (9'800'000), "9.8ms");
  EXPECT_EQ (time_text (33'366'666), "33.366666ms");
  EXPECT_EQ (time_text (1'500'000'000), "1.5s");
  EXPECT_EQ (time_text (kTimeLimit - 1), "3599.999999999s");
}

TEST (TimeText, ParsesBack)
{
  for (Nanoseconds scale = 1; scale < kTimeLimit; scale *= 10)
    for (Nanoseconds digits = 1; digits < 3000; digits += 7)
      for (const Nanoseconds extra : {0, 1, 50}) {
        const Nanoseconds time = scale * digits + extra;
        if (time >= kTimeLimit)
          continue;
        const auto back = parse_time (time_text (time));
        ASSERT_TRUE (back.ok ()) << time_text (time);
        ASSERT_EQ (*back, time);
      }
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The measured frame rate, compared with that of the caps. */
#include <random>

#include <gtest/gtest.h>

#include "sync/rate_watch.h"

using namespace codedexposure;

namespace
{

/* The report for frames of one rate with jitter and losses. */
std::vector<double>
told (FrameRate said, FrameRate real, double jitter_ms, double loss)
{
  RateWatch watch (said);
  std::mt19937 random (1);
  std::uniform_real_distribution delay (0.0, jitter_ms * 1e6 + 1e-3);
  std::bernoulli_distribution lost (loss);
  std::vector<double> rates;
  for (int k = 0; k < 1000; k++)
    if (!lost (random))
      if (const auto rate =
              watch.take (real.time_of (k) + Nanoseconds (delay (random))))
        rates.push_back (*rate);
  return rates;
}

} // namespace

TEST (RateWatch, SaysNothingOfTheRateThatWasSaid)
{
  for (const FrameRate rate : {FrameRate{25, 1}, FrameRate{30000, 1001}})
    for (const double loss : {0.0, 0.3}) {
      EXPECT_TRUE (told (rate, rate, 0, loss).empty ());
      EXPECT_TRUE (told (rate, rate, 5, loss).empty ());
    }
}

TEST (RateWatch, FramesThatAreHeldUpDoNotChangeTheRate)
{
  for (const double part : {0.01, 0.1})
    for (const double delay : {0.4, 0.6, 0.9}) {
      SCOPED_TRACE (delay);
      RateWatch watch ({25, 1});
      std::mt19937 random (1);
      std::bernoulli_distribution held_up (part);
      for (int k = 0; k < 6000; k++) {
        const auto late =
            Nanoseconds (held_up (random) ? delay * 40'000'000 : 0.0);
        EXPECT_FALSE (watch.take (k * 40'000'000LL + late)) << k;
      }
    }
}

/* As dmdsync sees them: counted as lost, then at an earlier time. */
TEST (RateWatch, FramesOutOfOrderDoNotChangeTheRate)
{
  RateWatch watch ({25, 1});
  for (int k = 0; k < 6000; k++) {
    const int frame = k % 100 == 50 ? k + 1 : k % 100 == 51 ? k - 1 : k;
    EXPECT_FALSE (watch.take (frame * 40'000'000LL)) << k;
  }
}

TEST (RateWatch, TellsAnotherRateOnce)
{
  for (const FrameRate real : {FrameRate{24, 1}, FrameRate{30000, 1001},
           FrameRate{50, 1}, FrameRate{25, 2}, FrameRate{200, 1}})
    for (const double loss : {0.0, 0.3}) {
      SCOPED_TRACE (real.num);
      const auto rates = told ({25, 1}, real, real.num > 100 ? 0 : 2, loss);
      ASSERT_EQ (rates.size (), 1u);
      EXPECT_NEAR (rates[0] * real.den / real.num, 1, 0.005);
    }
}

TEST (RateWatch, AGapThatIsNoneIsNotMeasured)
{
  RateWatch watch ({25, 1});
  for (int round = 0; round < 100; round++) {
    for (int k = 0; k < 3; k++)
      EXPECT_FALSE (watch.take (1'000'000'000LL * round + 40'000'000 * k));
    watch.resync ();
  }
}

/* Many recordings end before the rate is known to 1 %. */
TEST (RateWatch, TellsAHalfOrDoubleRateSoon)
{
  for (const FrameRate real : {FrameRate{50, 1}, FrameRate{25, 2}}) {
    RateWatch watch ({25, 1});
    for (int k = 0; k < 24; k++)
      EXPECT_FALSE (watch.take (real.time_of (k))) << k;
    const auto rate = watch.take (real.time_of (24));
    ASSERT_TRUE (rate);
    EXPECT_NEAR (*rate * real.den / real.num, 1, 1e-6);
  }
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The sensor's noise against theory. Seeds are fixed, so that limits at five
 * standard errors cannot fail by chance. */
#include "bench/sensor.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "bench/random.h"

namespace
{

using namespace codedexposure;

constexpr int kSide = 1000;
constexpr double kCount = kSide * double (kSide);

/* Numbers are electrons. */
Sensor
counting (double full_well = 65535.0)
{
  Sensor sensor;
  sensor.full_well = full_well;
  sensor.bits = 16;
  sensor.gain = full_well / 65535.0;
  sensor.seed = 20;
  return sensor;
}

Image<std::uint16_t>
read (const Sensor &sensor, const Image<float> &light, std::uint64_t frame = 0)
{
  Image<std::uint16_t> out (light.width (), light.height ());
  sensor.read_out (light.view (), sensor.full_well, frame, out.view ());
  return out;
}

Image<float>
flat (double electrons, int width = kSide, int height = kSide)
{
  Image<float> light (width, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      light.at (x, y) = float (electrons);
  return light;
}

struct Moments {
  double mean, variance;
};

Moments
moments (const Image<std::uint16_t> &image)
{
  double sum = 0, squares = 0;
  for (int y = 0; y < image.height (); y++)
    for (int x = 0; x < image.width (); x++) {
      sum += image.at (x, y);
      squares += double (image.at (x, y)) * image.at (x, y);
    }
  const double n = double (image.width ()) * image.height ();
  return {sum / n, squares / n - (sum / n) * (sum / n)};
}

/* Of the pixels of @a with those of @b, (dx, dy) away. */
double
correlation (const Image<std::uint16_t> &a, const Image<std::uint16_t> &b,
    int dx, int dy)
{
  const Moments ma = moments (a), mb = moments (b);
  double sum = 0;
  int n = 0;
  for (int y = 0; y + dy < a.height (); y++)
    for (int x = 0; x + dx < a.width (); x++, n++)
      sum += (a.at (x, y) - ma.mean) * (b.at (x + dx, y + dy) - mb.mean);
  return sum / n / std::sqrt (ma.variance * mb.variance);
}

TEST (Philox, GivesThePublishedNumbers)
{
  EXPECT_EQ (Philox::draw ({0, 0, 0, 0}, {0, 0}),
      (Philox::Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ (Philox::draw ({~0u, ~0u, ~0u, ~0u}, {~0u, ~0u}),
      (Philox::Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ (Philox::draw ({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
                 {0xa4093822, 0x299f31d0}),
      (Philox::Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

class ShotNoise : public ::testing::TestWithParam<double>
{
};

TEST_P (ShotNoise, HasPoissonMomentsAtEveryLevel)
{
  const double mean = GetParam ();
  const Moments seen = moments (read (counting (), flat (mean)));
  EXPECT_NEAR (seen.mean, mean, 5 * std::sqrt (mean / kCount));
  const double fourth = mean * (1 + 3 * mean);
  EXPECT_NEAR (
      seen.variance, mean, 5 * std::sqrt ((fourth - mean * mean) / kCount));
}

/* Pearson's statistic of the counts, over all values that a million draws
 * should show at least ten times. */
TEST_P (ShotNoise, HasPoissonDistributionAtEveryLevel)
{
  const double mean = GetParam ();
  const Image<std::uint16_t> numbers = read (counting (), flat (mean));
  std::vector<double> counts (65536, 0.0);
  for (int y = 0; y < kSide; y++)
    for (int x = 0; x < kSide; x++)
      counts[numbers.at (x, y)]++;

  double statistic = 0, others = kCount, others_expected = kCount;
  int cells = 0;
  for (int k = 0; k < 65536; k++) {
    const double expected =
        kCount * std::exp (k * std::log (mean) - mean - std::lgamma (k + 1.0));
    if (expected < 10)
      continue;
    statistic += std::pow (counts[std::size_t (k)] - expected, 2) / expected;
    others -= counts[std::size_t (k)];
    others_expected -= expected;
    cells++;
  }
  EXPECT_LT (statistic, cells + 5 * std::sqrt (2.0 * cells)) << cells;
  EXPECT_NEAR (others, others_expected, 5 * std::sqrt (others_expected) + 5)
      << "the tails";
}

INSTANTIATE_TEST_SUITE_P (Electrons, ShotNoise,
    ::testing::Values (0.01, 0.5, 5.0, 15.9, 16.1, 50.0, 500.0, 5000.0));

TEST (Noise, DarkPixelsHaveNoShotNoise)
{
  EXPECT_EQ (read (counting (), flat (0, 70, 3)), Image<std::uint16_t> (70, 3));
}

TEST (Noise, ReadNoiseAddsItsVariance)
{
  Sensor sensor = counting ();
  sensor.read_noise = 20;
  const Moments seen = moments (read (sensor, flat (500)));
  EXPECT_NEAR (seen.mean, 500, 5 * std::sqrt (900 / kCount));
  /* Rounding adds a twelfth. */
  EXPECT_NEAR (seen.variance, 900 + 1.0 / 12, 5 * 900 * std::sqrt (2 / kCount));
}

TEST (Noise, IsIndependentOfNeighboursAndFrames)
{
  Sensor sensor = counting ();
  sensor.read_noise = 5;
  const double limit = 5 / std::sqrt (kCount);
  for (const double level : {4.0, 200.0}) {
    const Image<float> light = flat (level);
    const Image<std::uint16_t> a = read (sensor, light, 7);
    for (const auto &[dx, dy] : {std::pair (1, 0), std::pair (0, 1),
             std::pair (1, 1), std::pair (32, 0), std::pair (64, 0)})
      EXPECT_NEAR (correlation (a, a, dx, dy), 0, limit) << dx << "," << dy;
    EXPECT_NEAR (correlation (a, read (sensor, light, 8), 0, 0), 0, limit);
    Sensor other = sensor;
    other.seed++;
    EXPECT_NEAR (correlation (a, read (other, light, 7), 0, 0), 0, limit);
    other.seed = sensor.seed + (std::uint64_t (1) << 32);
    EXPECT_NEAR (correlation (a, read (other, light, 7), 0, 0), 0, limit);
    EXPECT_NEAR (correlation (a,
                     read (sensor, light, 7 + (std::uint64_t (1) << 32)), 0, 0),
        0, limit);
  }
}

TEST (Noise, SameSeedAndFrameGiveTheSameBytes)
{
  Sensor sensor = counting ();
  sensor.read_noise = 3;
  const Image<float> light = flat (30, 130, 50);
  EXPECT_EQ (read (sensor, light, 3), read (sensor, light, 3));
  EXPECT_FALSE (read (sensor, light, 3) == read (sensor, light, 4));
}

TEST (Noise, OfAPixelDoesNotDependOnTheOthers)
{
  Sensor sensor = counting ();
  sensor.read_noise = 3;
  Image<float> light = flat (30, 130, 5);
  const Image<std::uint16_t> before = read (sensor, light);
  light.at (70, 2) = 4;
  const Image<std::uint16_t> after = read (sensor, light);
  for (int y = 0; y < 5; y++)
    for (int x = 0; x < 130; x++)
      if (x != 70 || y != 2) {
        ASSERT_EQ (before.at (x, y), after.at (x, y));
      }
}

/* Pins the generator: recordings made with a seed can be made again. */
TEST (Noise, StaysWhatItIs)
{
  Sensor sensor = counting ();
  sensor.read_noise = 2;
  const Image<std::uint16_t> few = read (sensor, flat (3, 4, 1), 1);
  const Image<std::uint16_t> many = read (sensor, flat (1000, 4, 1), 1);
  EXPECT_EQ (std::vector<int> (
                 {few.at (0, 0), few.at (1, 0), few.at (2, 0), few.at (3, 0)}),
      std::vector<int> ({2, 3, 0, 2}));
  EXPECT_EQ (std::vector<int> ({many.at (0, 0), many.at (1, 0), many.at (2, 0),
                 many.at (3, 0)}),
      std::vector<int> ({1012, 981, 986, 965}));
}

TEST (Sensor, FullWellBoundsTheElectrons)
{
  Sensor sensor = counting (1000);
  const Image<std::uint16_t> numbers = read (sensor, flat (1000, 200, 200));
  int full = 0, above = 0;
  for (int y = 0; y < 200; y++)
    for (int x = 0; x < 200; x++) {
      full += numbers.at (x, y) == 1000;
      above += numbers.at (x, y) > 1000;
    }
  EXPECT_EQ (above, 0);
  EXPECT_NEAR (full, 20000, 700);
}

TEST (Sensor, RoundsHalfUpAndClamps)
{
  Sensor sensor;
  sensor.bits = 4;
  Image<float> light (6, 1);
  const float in[] = {0.49f, 0.5f, 1.5f, 14.49f, 15.4f, 99.0f};
  std::copy_n (in, 6, light.view ().row (0));
  Image<std::uint8_t> out (6, 1);
  sensor.read_out (light.view (), 15.0, 0, out.view ());
  const std::uint8_t expected[] = {0, 1, 2, 14, 15, 15};
  for (int x = 0; x < 6; x++)
    EXPECT_EQ (out.at (x, 0), expected[x]);
}

} // namespace

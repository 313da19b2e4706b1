/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/rounding.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace codedexposure
{

namespace
{

/* Variance of rounding. */
constexpr double kRounding = 1.0 / 12.0;
/* Above this variance, rounding adds kRounding and does nothing else. */
constexpr double kSmooth = 0.8;
/* Below it, different noise makes the same values. */
constexpr double kHidden = 0.12;
constexpr int kSteps = 40; // of a bisection

double
below (double x)
{
  return 0.5 * std::erfc (-x / std::numbers::sqrt2);
}

/* Probability below z, by the series of Edgeworth. */
double
below (double z, double skewness)
{
  const double density =
      std::exp (-0.5 * z * z) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
  return below (z) - density * skewness / 6.0 * (z * z - 1.0);
}

/* The exact mean that is rounded to @seen, by bisection. */
double
mean_behind (double seen, double variance, double third, const Offsets &offsets)
{
  double low = seen - 2.0, high = seen + 1.0;
  for (int i = 0; i < kSteps; i++) {
    const double middle = 0.5 * (low + high);
    (rounded ({middle, variance, third}, offsets).mean < seen ? low : high) =
        middle;
  }
  return 0.5 * (low + high);
}

} // namespace

RoundedMoments
rounded_moments (double mean, double sigma, double third)
{
  const double skewness = third / (sigma * sigma * sigma);
  const int first = std::max (0, int (std::floor (mean - 6 * sigma)));
  const int last = std::max (first, int (std::ceil (mean + 6 * sigma)));
  double sum = 0.0, squares = 0.0, cubes = 0.0, fourth = 0.0, before = 0.0;
  for (int value = first; value <= last; value++) {
    const double to =
        value == last ? 1.0 : below ((value + 0.5 - mean) / sigma, skewness);
    const double x = value - mean, part = to - before;
    sum += x * part;
    squares += x * x * part;
    cubes += x * x * x * part;
    fourth += x * x * x * x * part;
    before = to;
  }
  return {mean + sum, squares - sum * sum,
      fourth - 4 * sum * cubes + 6 * sum * sum * squares -
          3 * sum * sum * sum * sum};
}

Moments
rounded (const Moments &exact, const Offsets &offsets)
{
  const double sigma = std::sqrt (std::max (1e-12, exact.variance));
  const auto pixel = [&] (double offset) {
    return rounded_moments (exact.mean + offset, sigma, exact.third);
  };
  if (offsets.empty ())
    return {pixel (0.0).mean, pixel (0.0).variance};
  Moments sum = {};
  for (const double offset : offsets) {
    const RoundedMoments one = pixel (offset);
    sum.mean += one.mean;
    sum.variance += one.variance;
  }
  return {sum.mean / double (offsets.size ()),
      sum.variance / double (offsets.size ())};
}

std::optional<Moments>
unrounded (const Moments &seen, const Offsets &offsets, double third)
{
  if (seen.variance > kSmooth && seen.mean > 6 * std::sqrt (seen.variance))
    return Moments{seen.mean, seen.variance - kRounding};
  double low = kHidden, high = seen.variance + 1.0;
  const auto excess = [&] (double variance) {
    const double mean = mean_behind (seen.mean, variance, third, offsets);
    return rounded ({mean, variance, third}, offsets).variance - seen.variance;
  };
  if (excess (low) > 0.0 || excess (high) < 0.0)
    return std::nullopt;
  for (int i = 0; i < kSteps; i++) {
    const double middle = 0.5 * (low + high);
    (excess (middle) < 0.0 ? low : high) = middle;
  }
  const double variance = 0.5 * (low + high);
  return Moments{mean_behind (seen.mean, variance, third, offsets), variance};
}

} // namespace codedexposure

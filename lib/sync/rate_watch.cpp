/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/rate_watch.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace codedexposure
{

namespace
{

constexpr std::size_t kSteps = 64;

/* Frames per second: steps over a loss are several periods of the usual step,
 * which is the median at first, then the mean of the steps near it. */
double
measure (std::vector<Nanoseconds> steps)
{
  const auto middle = steps.begin () + std::ptrdiff_t (steps.size () / 2);
  std::nth_element (steps.begin (), middle, steps.end ());
  auto usual = double (*middle);
  double periods = 0;
  double span = 0;
  for (const double max_count : {1.0, 1e9}) {
    periods = span = 0;
    for (const Nanoseconds step : steps) {
      const double count = std::max (1.0, std::round (double (step) / usual));
      if (count > max_count)
        continue;
      periods += count;
      span += double (step);
    }
    usual = span / periods;
  }
  return 1e9 / usual;
}

bool
differ (double a, double b)
{
  return std::abs (a - b) > RateWatch::kTolerance * b;
}

} // namespace

std::optional<double>
RateWatch::take (Nanoseconds time)
{
  if (last_ && time > *last_)
    steps_.push_back (time - *last_);
  last_ = time;
  if (steps_.size () < kSteps)
    return std::nullopt;

  const double rate = measure (std::exchange (steps_, {}));
  const double announced = double (announced_.num) / announced_.den;
  if (!differ (rate, reported_ > 0 ? reported_ : announced))
    return std::nullopt;
  reported_ = rate;
  return rate;
}

} // namespace codedexposure

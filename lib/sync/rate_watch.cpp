/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/rate_watch.h"

#include <cmath>
#include <utility>

#include "base/statistics.h"

namespace codedexposure
{

namespace
{

constexpr std::size_t kSteps = 64;

/* Mean of the steps near their median, which skips those over a loss and those
 * before and after a frame that came late. */
double
usual_step (std::vector<Nanoseconds> steps)
{
  const auto middle = double (median (steps));
  double sum = 0;
  int count = 0;
  for (const Nanoseconds step : steps)
    if (std::abs (double (step) - middle) <= middle / 2) {
      sum += double (step);
      count++;
    }
  return sum / count;
}

/* Frames per second. A frame that comes late by more than half a period makes
 * one step of two periods and one of none. */
double
measure (const std::vector<Nanoseconds> &steps)
{
  const double usual = usual_step (steps);
  double periods = 0;
  double span = 0;
  for (const Nanoseconds step : steps) {
    periods += std::nearbyint (double (step) / usual);
    span += double (step);
  }
  return 1e9 * periods / span;
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

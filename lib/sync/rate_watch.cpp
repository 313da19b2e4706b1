/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/rate_watch.h"

#include <cmath>

#include "base/statistics.h"

namespace codedexposure
{

namespace
{

constexpr std::size_t kSteps = 64, kFirstSteps = 24;

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

} // namespace

std::optional<double>
RateWatch::take (Nanoseconds time)
{
  if (last_ && time > *last_)
    steps_.push_back (time - *last_);
  last_ = time;
  const bool is_rough = is_first_;
  if (steps_.size () < (is_rough ? kFirstSteps : kSteps))
    return std::nullopt;

  is_first_ = false;
  const double rate = measure (steps_);
  if (!is_rough)
    steps_.clear ();
  const double known =
      reported_ > 0 ? reported_ : double (announced_.num) / announced_.den;
  if (std::abs (rate - known) <=
      (is_rough ? kRoughTolerance : kTolerance) * known)
    return std::nullopt;
  reported_ = rate;
  return rate;
}

} // namespace codedexposure

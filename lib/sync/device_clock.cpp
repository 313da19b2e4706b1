/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/device_clock.h"

#include <algorithm>
#include <cmath>

namespace codedexposure
{

namespace
{

/* Points of the window: with 5 ms of jitter, the error is 4 us (rms). */
constexpr std::size_t kMaxPoints = 4096;
/* Points to drop at a time, because every drop rebuilds the hull. */
constexpr std::size_t kForgotten = 512;
/* Faster frames share a point, so that the window covers the same time. */
constexpr double kSpacing = 40e6;

constexpr Nanoseconds kClockWentBack = 1'000'000'000;
/* A frame that is early by this belongs to another clock; from kSettled points
 * on, the line is known better. */
constexpr Nanoseconds kEarly = 20'000'000;
constexpr Nanoseconds kEarlySettled = 1'000'000;
constexpr std::size_t kSettled = 256;

/* Uncertainty of the drift once that of the line is below 25 us. */
constexpr double kSteady = 10e-6;
constexpr double kKnown = 25e3;

/* If the step is not one of a camera, only the order is kept. */
Nanoseconds
min_step (Nanoseconds device_step)
{
  return device_step > 0 && device_step <= kClockWentBack ? device_step / 2 : 1;
}

} // namespace

void
DeviceClock::reset ()
{
  last_.reset ();
  edge_.expect_any ();
}

void
DeviceClock::rejoin ()
{
  remember_drift ();
  last_.reset ();
}

/* Keeps the drift for the next line, if it is known well enough. */
void
DeviceClock::remember_drift ()
{
  if (deviation_ && *deviation_ < kKnown)
    edge_.expect (line_.slope, kSteady);
}

void
DeviceClock::begin (Nanoseconds device, Nanoseconds arrival)
{
  origin_device_ = device;
  origin_arrival_ = arrival;
  edge_.clear ();
  line_ = {};
  deviation_.reset ();
}

Nanoseconds
DeviceClock::pipeline_time (Nanoseconds device) const
{
  const Nanoseconds since = device - origin_device_;
  return origin_arrival_ + since + std::llround (line_.at (double (since)));
}

bool
DeviceClock::went_back (Nanoseconds device) const
{
  return device < last_->device - kClockWentBack;
}

bool
DeviceClock::is_restart (Nanoseconds device, Nanoseconds arrival) const
{
  const Nanoseconds early =
      edge_.points ().size () < kSettled ? kEarly : kEarlySettled;
  return went_back (device) || arrival < pipeline_time (device) - early;
}

void
DeviceClock::learn (LowerEdge::Point point)
{
  const auto &points = edge_.points ();
  const bool shares =
      points.size () > 1 && point.x - points[points.size () - 2].x < kSpacing;
  if (!shares)
    edge_.add (point);
  else if (point.y < points.back ().y)
    edge_.lower_last (point);
  else
    return;
  if (points.size () > kMaxPoints)
    edge_.forget (kForgotten);
  const LowerEdge::Estimate estimate = edge_.estimate ();
  line_ = estimate.line;
  deviation_ = estimate.deviation;
}

Nanoseconds
DeviceClock::take (Nanoseconds device, Nanoseconds arrival)
{
  const bool restarted = last_ && is_restart (device, arrival);
  restarts_ += restarted;
  if (restarted)
    remember_drift ();
  if (!last_ || restarted)
    begin (device, arrival);
  const bool late = last_ && !restarted && device <= last_->device;
  if (!late)
    learn ({double (device - origin_device_),
        double ((arrival - origin_arrival_) - (device - origin_device_))});
  const Nanoseconds estimate = pipeline_time (device);
  lateness_ = std::max<Nanoseconds> (0, arrival - estimate);
  Nanoseconds time = estimate;
  if (!late) {
    if (last_)
      time = std::max (
          time, last_->pipeline_time + min_step (device - last_->device));
    last_ = Mark{device, time};
  }
  uncertainty_.reset ();
  if (deviation_)
    uncertainty_ = time - estimate + std::llround (2 * *deviation_);
  return time;
}

std::optional<Nanoseconds>
DeviceClock::time_of (Nanoseconds device) const
{
  if (!last_ || went_back (device))
    return std::nullopt;
  return pipeline_time (device);
}

} // namespace codedexposure

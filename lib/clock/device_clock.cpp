/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "clock/device_clock.h"

#include <algorithm>
#include <cmath>

namespace cexp
{

namespace
{

/* Points of the window: 5 ms of jitter leave some 20 us with as many. */
constexpr std::size_t kMostPoints = 4096;
/* That many go at once, so that the hull is made anew once for all of them. */
constexpr std::ptrdiff_t kForgotten = 512;
/* Frames that come faster share a point, and the window lasts as long. */
constexpr double kSpacing = 40e6;

constexpr Nanoseconds kClockWentBack = 1'000'000'000;
/* A frame that is early by this tells of another clock; the line is known
 * better with kSettled points than before. */
constexpr Nanoseconds kEarly = 20'000'000;
constexpr Nanoseconds kEarlySettled = 1'000'000;
constexpr std::size_t kSettled = 256;

/* A step that is none of a camera's leaves only the order. */
Nanoseconds
least_step (Nanoseconds device_step)
{
  return device_step > 0 && device_step <= kClockWentBack ? device_step / 2 : 1;
}

} // namespace

void
DeviceClock::reset ()
{
  last_.reset ();
}

void
DeviceClock::begin (Nanoseconds device, Nanoseconds arrival)
{
  origin_device_ = device;
  origin_arrival_ = arrival;
  points_.clear ();
  hull_.clear ();
  slope_ = 0;
  height_ = 0;
}

Nanoseconds
DeviceClock::told (Nanoseconds device) const
{
  const Nanoseconds since = device - origin_device_;
  return origin_arrival_ + since +
         std::llround (height_ + slope_ * double (since));
}

bool
DeviceClock::is_anew (Nanoseconds device, Nanoseconds arrival) const
{
  const Nanoseconds early = points_.size () < kSettled ? kEarly : kEarlySettled;
  return device < last_->device - kClockWentBack ||
         arrival < told (device) - early;
}

void
DeviceClock::add_to_hull (Point point)
{
  const auto is_above = [&] (const Point &a, const Point &b) {
    return (b.delay - a.delay) * (point.device - a.device) >=
           (point.delay - a.delay) * (b.device - a.device);
  };
  while (
      hull_.size () > 1 && is_above (hull_[hull_.size () - 2], hull_.back ()))
    hull_.pop_back ();
  hull_.push_back (point);
}

void
DeviceClock::forget_oldest ()
{
  points_.erase (points_.begin (), points_.begin () + kForgotten);
  hull_.clear ();
  for (const Point &point : points_)
    add_to_hull (point);
}

void
DeviceClock::learn (Point point)
{
  const bool shares =
      points_.size () > 1 &&
      point.device - points_[points_.size () - 2].device < kSpacing;
  if (!shares)
    points_.push_back (point);
  else if (point.delay < points_.back ().delay)
    points_.back () = point;
  else
    return;
  add_to_hull (point);
  if (points_.size () > kMostPoints)
    forget_oldest ();
}

/* The edge above the middle has the least sum of distances; a steeper one than
 * clocks are is replaced by the steepest line that is still below all. */
void
DeviceClock::fit ()
{
  slope_ = 0;
  if (hull_.size () > 1) {
    const double middle =
        (points_.front ().device + points_.back ().device) / 2;
    const auto right = std::upper_bound (hull_.begin () + 1, hull_.end () - 1,
        middle, [] (double x, const Point &p) { return x < p.device; });
    const auto left = right - 1;
    slope_ = std::clamp (
        (right->delay - left->delay) / (right->device - left->device),
        -kMostDrift, kMostDrift);
  }
  const auto height = [this] (const Point &p) {
    return p.delay - slope_ * p.device;
  };
  height_ = height (hull_.front ());
  for (const Point &point : hull_)
    height_ = std::min (height_, height (point));
}

Nanoseconds
DeviceClock::take (Nanoseconds device, Nanoseconds arrival)
{
  const bool anew = last_ && is_anew (device, arrival);
  restarts_ += anew;
  if (!last_ || anew)
    begin (device, arrival);
  const bool late = last_ && !anew && device <= last_->device;
  if (!late) {
    learn ({double (device - origin_device_),
        double ((arrival - origin_arrival_) - (device - origin_device_))});
    fit ();
  }
  Nanoseconds time = told (device);
  lateness_ = std::max<Nanoseconds> (0, arrival - time);
  if (late)
    return time;
  if (last_)
    time = std::max (time, last_->told + least_step (device - last_->device));
  last_ = Mark{device, time};
  return time;
}

} // namespace cexp

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/light_window.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace codedexposure
{

namespace
{

/* Of a lamp that is on for the part @duty of each pulse: its light after so
 * many @pulses, in units of that of a pulse, and the integral of that. */
double
light_of (double pulses, double duty)
{
  const double whole = std::floor (pulses);
  return whole + std::min ((pulses - whole) / duty, 1.0);
}

double
area_of (double pulses, double duty)
{
  const double whole = std::floor (pulses), rest = pulses - whole;
  const double last =
      rest < duty ? 0.5 * rest * rest / duty : rest - 0.5 * duty;
  return 0.5 * whole * (whole - 1.0) + whole * (1.0 - 0.5 * duty) +
         whole * rest + last;
}

} // namespace

LightWindow::LightWindow (const LightOverTime &light, Nanoseconds begin,
    Nanoseconds end, Nanoseconds transition)
    : begin_ (begin), length_ (1e-9 * double (end - begin)),
      transition_ (1e-9 * double (transition)), slope_ (light.drift),
      depth_ (light.flicker_depth),
      omega_ (2.0 * std::numbers::pi * light.flicker_rate),
      pulse_rate_ (light.pulse_rate), pulse_duty_ (light.pulse_duty)
{
  const double start = 1e-9 * double (begin);
  pulses_ = std::fmod (pulse_rate_ * start + light.phase, 1.0);
  level_ = 1.0 + slope_ * start;
  phase_ = std::fmod (omega_ * start, 2.0 * std::numbers::pi) + light.phase;
  whole_ = light_to (length_);
  area_ = area_to (length_);
}

/* The first x seconds of an exposure with pulses of unit mean. */
double
LightWindow::pulsed_to (double x) const
{
  if (pulse_rate_ <= 0.0)
    return x;
  return (light_of (pulses_ + pulse_rate_ * x, pulse_duty_) -
             light_of (pulses_, pulse_duty_)) /
         pulse_rate_;
}

/* Integral of pulsed_to (). */
double
LightWindow::pulsed_area_to (double x) const
{
  if (pulse_rate_ <= 0.0)
    return 0.5 * x * x;
  const double before = light_of (pulses_, pulse_duty_);
  const double area = area_of (pulses_ + pulse_rate_ * x, pulse_duty_) -
                      area_of (pulses_, pulse_duty_);
  return (area / pulse_rate_ - before * x) / pulse_rate_;
}

/* Integral of the light over the first x seconds of the exposure. */
double
LightWindow::light_to (double x) const
{
  const double steady = level_ * pulsed_to (x) + 0.5 * slope_ * x * x;
  if (depth_ == 0.0)
    return steady;
  return steady +
         depth_ / omega_ * (std::cos (phase_) - std::cos (phase_ + omega_ * x));
}

/* Integral of light_to (). */
double
LightWindow::area_to (double x) const
{
  const double steady = level_ * pulsed_area_to (x) + slope_ * x * x * x / 6.0;
  if (depth_ == 0.0)
    return steady;
  const double swing = std::sin (phase_ + omega_ * x) - std::sin (phase_);
  return steady + depth_ / omega_ * (x * std::cos (phase_) - swing / omega_);
}

/* The same for any x: nothing comes before the exposure, or after it. */
double
LightWindow::area_before (double x) const
{
  if (x <= 0.0)
    return 0.0;
  return x <= length_ ? area_to (x) : area_ + whole_ * (x - length_);
}

double
LightWindow::through (Nanoseconds on, Nanoseconds off) const
{
  const double a = 1e-9 * double (on - begin_);
  const double b = 1e-9 * double (off - begin_);
  if (a >= b || a >= length_ || b + transition_ <= 0.0)
    return 0.0;
  if (transition_ <= 0.0) {
    const auto within = [this] (double x) {
      return x <= 0.0 ? 0.0 : x < length_ ? light_to (x) : whole_;
    };
    return within (b) - within (a);
  }
  /* The position is the mean of what was told in the last transition time. */
  return (area_before (b + transition_) - area_before (a + transition_) -
             (area_before (b) - area_before (a))) /
         transition_;
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Light that mirrors pass on in an exposure, over true time. */
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "schedule/timing.h"

namespace codedexposure
{

/** Light over time: its mean is 1 at time 0. */
struct LightOverTime {
  double flicker_rate = 100.0; ///< Hz
  double flicker_depth = 0.0;  ///< amplitude / mean
  double phase = 0.0;          ///< at time 0, radians
  double drift = 0.0;          ///< 1/s
  /** Of a lamp that is dimmed by switching it: pulses/s, and the part of the
   * time in which it is on. 0: it is not. */
  double pulse_rate = 0.0, pulse_duty = 0.5;
};

/**
 * The light of an exposure, in closed form.
 *
 * Mirrors move from one position to the other within a transition time, at
 * constant speed.
 */
class ExposureLight
{
public:
  /** An exposure [@p begin, @p end), and mirrors that take @p transition. */
  ExposureLight (const LightOverTime &light, Nanoseconds begin, Nanoseconds end,
      Nanoseconds transition)
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

  /** Light of mirrors that are told to be on in [@p on, @p off), in seconds of
   * mean light. */
  double through (Nanoseconds on, Nanoseconds off) const
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

  /** Light of mirrors that are always on. */
  double whole () const { return whole_; }

private:
  /* Of a lamp that is on for the part @duty of each pulse: its light after so
   * many @pulses, in units of that of a pulse, and the integral of that. */
  static double light_of (double pulses, double duty)
  {
    const double whole = std::floor (pulses);
    return whole + std::min ((pulses - whole) / duty, 1.0);
  }

  static double area_of (double pulses, double duty)
  {
    const double whole = std::floor (pulses), rest = pulses - whole;
    const double last =
        rest < duty ? 0.5 * rest * rest / duty : rest - 0.5 * duty;
    return 0.5 * whole * (whole - 1.0) + whole * (1.0 - 0.5 * duty) +
           whole * rest + last;
  }

  /* Integral of the light over the first x seconds of the exposure. */
  double light_to (double x) const
  {
    const double steady = level_ * pulsed_to (x) + 0.5 * slope_ * x * x;
    if (depth_ == 0.0)
      return steady;
    return steady + depth_ / omega_ *
                        (std::cos (phase_) - std::cos (phase_ + omega_ * x));
  }

  /* Integral of light_to (). */
  double area_to (double x) const
  {
    const double steady =
        level_ * pulsed_area_to (x) + slope_ * x * x * x / 6.0;
    if (depth_ == 0.0)
      return steady;
    const double swing = std::sin (phase_ + omega_ * x) - std::sin (phase_);
    return steady + depth_ / omega_ * (x * std::cos (phase_) - swing / omega_);
  }

  /* The same for any x: nothing comes before the exposure, or after it. */
  double area_before (double x) const
  {
    if (x <= 0.0)
      return 0.0;
    return x <= length_ ? area_to (x) : area_ + whole_ * (x - length_);
  }

  /* The first x seconds of an exposure with pulses of unit mean. */
  double pulsed_to (double x) const
  {
    if (pulse_rate_ <= 0.0)
      return x;
    return (light_of (pulses_ + pulse_rate_ * x, pulse_duty_) -
               light_of (pulses_, pulse_duty_)) /
           pulse_rate_;
  }

  /* Integral of pulsed_to (). */
  double pulsed_area_to (double x) const
  {
    if (pulse_rate_ <= 0.0)
      return 0.5 * x * x;
    const double before = light_of (pulses_, pulse_duty_);
    const double area = area_of (pulses_ + pulse_rate_ * x, pulse_duty_) -
                        area_of (pulses_, pulse_duty_);
    return (area / pulse_rate_ - before * x) / pulse_rate_;
  }

  Nanoseconds begin_;
  double length_, transition_; // s
  double level_, slope_;       // at begin_; 1/s
  double depth_, omega_, phase_;
  double pulse_rate_, pulse_duty_, pulses_; // begun at begin_
  double whole_ = 0.0, area_ = 0.0;
};

} // namespace codedexposure

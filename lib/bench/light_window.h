/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Light that mirrors pass on in an exposure, over true time. */
#pragma once

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
class LightWindow
{
public:
  /** An exposure [@p begin, @p end), and mirrors that take @p transition. */
  LightWindow (const LightOverTime &light, Nanoseconds begin, Nanoseconds end,
      Nanoseconds transition);

  /** Light of mirrors that are told to be on in [@p on, @p off), in seconds of
   * mean light. */
  double through (Nanoseconds on, Nanoseconds off) const;
  /** Light of mirrors that are always on. */
  double whole () const { return whole_; }

private:
  double light_to (double x) const;
  double area_to (double x) const;
  double area_before (double x) const;
  double pulsed_to (double x) const;
  double pulsed_area_to (double x) const;

  Nanoseconds begin_;
  double length_, transition_; // s
  double level_, slope_;       // at begin_; 1/s
  double depth_, omega_, phase_;
  double pulse_rate_, pulse_duty_, pulses_; // begun at begin_
  double whole_ = 0.0, area_ = 0.0;
};

} // namespace codedexposure

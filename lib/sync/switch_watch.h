/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The first frame that shows a new mask of the DMD. */
#pragma once

#include <algorithm>

namespace codedexposure
{

/**
 * Before it shows something else, a DMD leaves one exposure dark, or without a
 * trigger (dmd.h). Frames exposed before may still arrive after the switch; the
 * dark frame, or the gap, ends them.
 *
 * If the new mask is dark itself, that border is invisible: the switch counts
 * after kPatience frames, more than a camera buffers.
 */
class SwitchWatch
{
public:
  static constexpr int kPatience = 8;

  /** @p gap_shows  the camera gets its trigger from the DMD. @p black  digital
   * number without light. */
  explicit SwitchWatch (bool gap_shows = false, double black = 0.0)
      : gap_shows_ (gap_shows), black_ (black)
  {
  }

  bool waiting () const { return waiting_; }
  /** A switch is requested. */
  void begin ()
  {
    waiting_ = true;
    border_seen_ = false;
    since_ = 0;
  }
  /**
   * Whether a frame shows the new mask.
   * @p done   the device reports the switch.
   * @p level  mean of the frame.
   * @p gap    frames are missing before this one.
   */
  bool take (bool done, double level, bool gap)
  {
    const double light = level - black_;
    const bool dark = light < brightest_ / kDarkPart;
    brightest_ = std::max (brightest_, light);
    if (!waiting_)
      return true;
    border_seen_ = border_seen_ || dark || (gap && gap_shows_);
    since_ += done;
    waiting_ = !(done && ((border_seen_ && !dark) || since_ > kPatience));
    return !waiting_;
  }

private:
  /* Gratings and codes are brighter, off-state leakage is darker. */
  static constexpr double kDarkPart = 8.0;

  bool gap_shows_;
  double black_;
  bool waiting_ = false;
  bool border_seen_ = false;
  int since_ = 0;
  double brightest_ = 0.0; // light of a frame
};

} // namespace codedexposure

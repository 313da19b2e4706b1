/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* From which frame on a DMD shows what it was told to. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "base/image.h"

namespace codedexposure
{

/** Mean of all pixels, which are not none. */
template <typename Pixel>
double
mean_level (ImageView<const Pixel> frame)
{
  double sum = 0.0;
  for (int y = 0; y < frame.height; y++)
    sum += double (std::accumulate (
        frame.row (y), frame.row (y) + frame.width, std::uint64_t (0)));
  return sum / (double (frame.width) * frame.height);
}

/**
 * A DMD that shows something else leaves one exposure dark, or without a
 * trigger, before it does (dmd.h). Frames that were exposed before may still
 * come after it was done; the dark frame, or the gap, is where they end.
 *
 * What is dark itself shows no such border: it is believed after kPatience
 * frames, more than a camera keeps on the way.
 */
class SwitchWatch
{
public:
  static constexpr int kPatience = 8;

  /** @p gap_shows  the camera gets its trigger from the DMD. */
  explicit SwitchWatch (bool gap_shows = false) : gap_shows_ (gap_shows) {}

  bool waiting () const { return waiting_; }
  /** Something else is asked for. */
  void begin ()
  {
    waiting_ = true;
    border_seen_ = false;
    since_ = 0;
  }
  /**
   * Whether a frame shows it.
   * @p done   the device says that it does.
   * @p level  mean_level () of the frame.
   * @p gap    frames are missing before this one.
   */
  bool take (bool done, double level, bool gap)
  {
    const bool dark = level < brightest_ / kDarkPart;
    brightest_ = std::max (brightest_, level);
    if (!waiting_)
      return true;
    border_seen_ = border_seen_ || dark || (gap && gap_shows_);
    since_ += done;
    waiting_ = !(done && ((border_seen_ && !dark) || since_ > kPatience));
    return !waiting_;
  }

private:
  /* Gratings and codes keep above it, light that shut mirrors leak below. */
  static constexpr double kDarkPart = 8.0;

  bool gap_shows_;
  bool waiting_ = false;
  bool border_seen_ = false;
  int since_ = 0;
  double brightest_ = 0.0;
};

} // namespace codedexposure

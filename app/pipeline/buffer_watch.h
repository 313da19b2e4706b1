/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <algorithm>
#include <chrono>
#include <string>

#include <gst/gst.h>

#include "common/raii.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

/** Says when frames wait for encoder and disk in the queue of a recording, and
 * how long its room lasts, before the source has to drop frames. */
class BufferWatch
{
public:
  using Clock = std::chrono::steady_clock;

  /** @p queue outlives this. */
  explicit BufferWatch (GstElement *queue) : queue_ (queue) {}

  /** Often. A line for the user, or nothing. Also posts the element message
   * `codedexposure/recording-behind`. */
  std::string tick (Clock::time_point now = Clock::now ())
  {
    const Level level = read ();
    const double seconds =
        std::chrono::duration<double> (now - since_).count ();
    const double growth = seconds > 0 ? (level.fill - fill_) / seconds : 0;
    since_ = now;
    fill_ = level.fill;
    if (level.fill >= kFull && state_ != kIsFull) {
      state_ = kIsFull;
      post (level, 0);
      return format (
          "warning: %u frames wait to be written, and the buffer is full: "
          "frames are lost until encoder and disk catch up",
          level.frames);
    }
    if (level.fill >= kHalf && growth > 0 && state_ == kKeepsUp) {
      state_ = kBehind;
      const double left = (1 - level.fill) / growth;
      post (level, left);
      return format (
          "warning: %u frames wait to be written, the buffer is %.0f %% full "
          "and lasts %.1f s more; then frames are lost: use a faster disk, "
          "fewer "
          "frames/s, or raw in place of FFV1",
          level.frames, 100 * level.fill, left);
    }
    if (level.fill < kLow && state_ != kKeepsUp) {
      state_ = kKeepsUp;
      post (level, -1);
      return "encoder and disk have caught up; the buffer is " +
             format ("%.0f %% full", 100 * level.fill);
    }
    return {};
  }

private:
  static constexpr double kLow = 0.25, kHalf = 0.5, kFull = 0.98;
  enum State { kKeepsUp, kBehind, kIsFull };
  struct Level {
    guint frames;
    double fill; ///< 0 to 1
  };

  Level read () const
  {
    guint frames = 0, bytes = 0, most_frames = 0, most_bytes = 0;
    g_object_get (queue_, "current-level-buffers", &frames,
        "current-level-bytes", &bytes, "max-size-buffers", &most_frames,
        "max-size-bytes", &most_bytes, nullptr);
    const auto share = [] (guint level, guint most) {
      return most > 0 ? double (level) / most : 0;
    };
    return {frames,
        std::max (share (frames, most_frames), share (bytes, most_bytes))};
  }
  void post (const Level &level, double left)
  {
    gst_element_post_message (queue_,
        gst_message_new_element (GST_OBJECT (queue_),
            gst_structure_new ("codedexposure/recording-behind", "active",
                G_TYPE_BOOLEAN, left >= 0, "frames", G_TYPE_UINT, level.frames,
                "fill", G_TYPE_DOUBLE, level.fill, "time-left", G_TYPE_DOUBLE,
                std::max (left, 0.0), nullptr)));
  }

  GstElement *queue_; // of the pipeline
  Clock::time_point since_ = Clock::now ();
  double fill_ = 0;
  State state_ = kKeepsUp;
};

} // namespace codedexposure::app

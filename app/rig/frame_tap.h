/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Takes the frames that pass a pad, on another thread. */
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>

#include <gst/video/video.h>

#include "common/raii.h"
#include "pipeline/pads.h"
#include "schedule/timing.h"

namespace codedexposure::app
{

inline Nanoseconds
monotonic_now ()
{
  return g_get_monotonic_time () * 1000;
}

/** A frame, and when it passed by the monotonic clock. */
struct TappedFrame {
  gst::BufferPtr buffer;
  GstVideoInfo info;
  Nanoseconds arrival;
};

/** Keeps the frames that pass a pad until they are taken, the last ones where
 * there is a limit. Thread-safe. */
class FrameTap
{
public:
  explicit FrameTap (gst::ObjectPtr<GstPad> pad) : pad_ (std::move (pad))
  {
    probe_ = add_probe (pad_.get (),
        GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
        [this] (GstPad *at, GstPadProbeInfo *info) {
          add (at, info);
          return GST_PAD_PROBE_OK;
        });
  }
  ~FrameTap () { gst_pad_remove_probe (pad_.get (), probe_); }
  FrameTap (const FrameTap &) = delete;
  FrameTap &operator= (const FrameTap &) = delete;

  /** The next frame; none comes within @p time, or after the end. */
  std::optional<TappedFrame> take (std::chrono::milliseconds time)
  {
    std::unique_lock guard (lock_);
    came_.wait_for (
        guard, time, [this] { return ended_ || !frames_.empty (); });
    if (frames_.empty ())
      return std::nullopt;
    std::optional<TappedFrame> first (std::move (frames_.front ()));
    frames_.pop_front ();
    return first;
  }
  /** Keeps @p most bytes and a frame more. */
  void limit (gsize most)
  {
    const std::lock_guard guard (lock_);
    most_ = most;
  }
  void forget ()
  {
    const std::lock_guard guard (lock_);
    frames_.clear ();
  }
  /** Whether all frames were taken, and no more come. */
  bool ended ()
  {
    const std::lock_guard guard (lock_);
    return ended_ && frames_.empty ();
  }

private:
  void add (GstPad *pad, GstPadProbeInfo *info)
  {
    const Nanoseconds now = monotonic_now ();
    GstBuffer *buffer = GST_PAD_PROBE_INFO_BUFFER (info);
    const bool is_frame = info->type & GST_PAD_PROBE_TYPE_BUFFER;
    const bool is_end = !is_frame && GST_EVENT_TYPE (GST_PAD_PROBE_INFO_EVENT (
                                         info)) == GST_EVENT_EOS;
    const auto video = video_at (pad);
    const std::lock_guard guard (lock_);
    ended_ |= is_end;
    if (is_frame && video) {
      frames_.push_back (
          {gst::BufferPtr (gst_buffer_ref (buffer)), *video, now});
      while (frames_.size () > 1 + most_ / std::max<gsize> (1, video->size))
        frames_.pop_front ();
    }
    came_.notify_all ();
  }

  const gst::ObjectPtr<GstPad> pad_;
  gulong probe_ = 0;
  std::mutex lock_; // of all below
  std::condition_variable came_;
  std::deque<TappedFrame> frames_;
  bool ended_ = false;
  gsize most_ = std::numeric_limits<gsize>::max ();
};

} // namespace codedexposure::app

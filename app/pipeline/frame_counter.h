/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include <gst/gst.h>

#include "common/excerpt.h"
#include "common/raii.h"

namespace codedexposure::app
{

/** Lets the running time behind @p element begin at 0 with its first frame. */
void begin_at_zero (GstElement *element);
/** Lets it be the time of the frames. */
void keep_times (GstElement *element);

/** Which part of a recording is played, and at which running times. Positions
 * are stream times: they count from the first frame. */
struct PlayTimes {
  /** The coded frames whose positions lie in [start, stop), ns; the elements
   * read what they need around them. None: the whole. */
  std::optional<GstClockTime> start, stop;
  /** Running time of the first frame, ns. */
  std::optional<GstClockTime> shift_to;

  bool is_part () const { return start || stop; }
  bool holds (GstClockTime position) const
  {
    return !is_part () || (position + gst::kRounding >= start.value_or (0) &&
                              (!stop || position + gst::kRounding < *stop));
  }
};

/** Counts the coded frames at a pad, and fits their times to what is wanted. */
class FrameCounter
{
public:
  /** @p sink         the pad, before the pipeline plays.
   * @p cannot_seek  the part is not in the stream; called on the thread of the
   * main loop. */
  FrameCounter (gst::ObjectPtr<GstPad> sink, const PlayTimes &times,
      std::function<void ()> cannot_seek);
  ~FrameCounter ();
  FrameCounter (const FrameCounter &) = delete;
  FrameCounter &operator= (const FrameCounter &) = delete;

  GstPad *pad () const { return pad_.get (); }
  const std::atomic<gint64> &frames () const { return frames_; }
  /** The share of the stream that was played, of @p total frames if above 0;
   * 0: unknown. */
  double done (gint64 total) const;
  /** "from A to B": the last two schedules of the frames; empty: they have one.
   */
  std::string schedule_change () const;
  /** Ends the stream after the frames that were counted. */
  void end ();

private:
  gst::ObjectPtr<GstElement> element () const;
  void hold_first_frame ();
  void seek ();
  void count (GstBuffer *frame);
  void follow_schedule ();

  const gst::ObjectPtr<GstPad> pad_;
  const PlayTimes times_;
  const std::function<void ()> cannot_seek_;
  std::atomic<gint64> frames_ = 0;
  std::atomic<gint64> last_ = -1; // position, ns
  std::string tagged_, schedule_; // of the next frame, of the last one
  mutable std::mutex mutex_;
  std::string change_; // with the mutex
  gulong hold_ = 0;    // probe that holds the first frame until the seek
};

} // namespace codedexposure::app

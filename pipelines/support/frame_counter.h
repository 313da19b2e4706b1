/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <atomic>
#include <functional>
#include <optional>

#include <gst/gst.h>

#include "common/raii.h"
#include "excerpt.h"

/** Lets the running time behind @p element begin at 0 with its first frame. */
void begin_at_zero (GstElement *element);

/** Counts the coded frames at a pad, and fits their times to what is wanted. */
class FrameCounter
{
public:
  /** In seconds. */
  struct Times {
    gdouble start = 0;     // of the stream, at which to start
    gdouble duration = 0;  // to play; 0: all
    gdouble shift_to = -1; // running time of the first frame; -1: unchanged
    gboolean keep_time = FALSE;     // running time is the time of the recording
    std::optional<Excerpt> excerpt; // only its frames are counted; no duration
  };

  /** @p sink         the pad, before the pipeline plays.
   * @p cannot_seek  called on the thread of the main loop. */
  FrameCounter (codedexposure::gst::ObjectPtr<GstPad> sink, const Times &times,
      std::function<void ()> cannot_seek);
  ~FrameCounter ();
  FrameCounter (const FrameCounter &) = delete;
  FrameCounter &operator= (const FrameCounter &) = delete;

  GstPad *pad () const { return pad_.get (); }
  const std::atomic<gint64> &frames () const { return frames_; }
  /** The share of the stream that was played, of @p total frames if above 0;
   * 0: unknown. */
  double done (gint64 total) const;
  /** Ends the stream after the frames that were counted. */
  void end ();

private:
  void seek ();
  GstEvent *new_seek () const;
  static gboolean on_held (gpointer self);
  static GstPadProbeReturn hold_first_frame (
      GstPad *, GstPadProbeInfo *, gpointer self);
  static GstPadProbeReturn shift_first_frame (
      GstPad *pad, GstPadProbeInfo *info, gpointer self);
  static GstPadProbeReturn on_frame (
      GstPad *, GstPadProbeInfo *info, gpointer self);

  const codedexposure::gst::ObjectPtr<GstPad> pad_;
  const Times times_;
  const std::function<void ()> cannot_seek_;
  std::atomic<gint64> frames_ = 0;
  std::atomic<gint64> last_pts_ = -1; // ns
  gulong hold_ = 0;   // probe that holds the first frame until the seek
  bool held_ = false; // streaming thread
};

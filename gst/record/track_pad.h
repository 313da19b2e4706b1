/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The pad of the part log that gives one line of text a frame. */
#pragma once

#include <string>

#include <gst/gst.h>

#include "common/request_pad.h"

namespace codedexposure::gst
{

/** One buffer of text a frame, with the frame's PTS and DURATION, on the
 * frames' streaming thread. Without a pad all calls do nothing. */
class TrackPad
{
public:
  explicit TrackPad (GstElement *element) : element_ (element), pad_ (element)
  {
  }

  /** Any thread. Null if there is one already. */
  GstPad *request (GstPadTemplate *templ);
  void release (GstPad *pad) { pad_.release (pad); }
  bool exists () const { return pad_.get () != nullptr; }

  /* Streaming thread: */

  /** Text that belongs to @p segment. */
  GstFlowReturn push (const std::string &text, GstClockTime pts,
      GstClockTime duration, const GstSegment &segment);
  /** The next text belongs to another segment or stream. */
  void restart (bool stream);
  /** Forwards EOS and flushes. */
  void forward (GstEvent *event);

private:
  void start (GstPad *pad, const GstSegment &segment);

  GstElement *element_;
  RequestPad pad_;
  /* Streaming thread. */
  bool stream_sent_ = false;
  bool segment_sent_ = false;
};

} // namespace codedexposure::gst

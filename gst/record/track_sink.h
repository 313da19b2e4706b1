/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The pad of the part restore that takes the text track of a recording. */
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>

#include <gst/gst.h>

#include "common/raii.h"
#include "record/track_reader.h"

namespace codedexposure::gst
{

/** Which frames of a segment come, and in which order. */
TrackReader::Order order_of (const GstSegment &segment);

/** Reads the lines that come on the track's streaming thread, plain or as Pango
 * markup, and gives each frame its line. */
class TrackSink
{
public:
  /** @p pad: of the element. */
  void take_over (GstPad *pad);

  /* Any thread: */

  bool is_linked () const { return gst_pad_is_linked (pad_); }
  /** Lines that could not be read since restart (). */
  guint64 damaged () const { return damaged_; }

  /** Before a run. */
  void restart ();

  /* Streaming thread of the frames: */

  /** What @p use returns of the reader, to which no line comes meanwhile. Never
   * push inside. */
  template <typename Use>
  auto read (Use use)
  {
    return locked (lock_, [&] { return use (reader_); });
  }
  /** TrackReader::take (), or take_now () if the line is not waited for: then
   * there always is a match. */
  std::optional<TrackReader::Match> take (
      Nanoseconds pts, Nanoseconds start, bool wait)
  {
    return read ([=] (TrackReader &reader) {
      return wait ? reader.take (pts, start) : reader.take_now (pts, start);
    });
  }

private:
  static GstFlowReturn chain (
      GstPad *pad, GstObject *parent, GstBuffer *buffer) noexcept;
  static gboolean event (
      GstPad *pad, GstObject *parent, GstEvent *event) noexcept;
  Result<void> add (
      const std::string &text, Nanoseconds pts, Nanoseconds duration);

  GstPad *pad_ = nullptr;
  std::atomic<guint64> damaged_ = 0;

  std::mutex lock_;     ///< never held while pushing
  TrackReader reader_;  ///< lock_
  bool markup_ = false; ///< lock_; the text is escaped
};

} // namespace codedexposure::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The pad of the part restore that takes the text track of a recording. */
#pragma once

#include <atomic>
#include <deque>
#include <optional>
#include <string>

#include <gst/gst.h>

#include "common/raii.h"
#include "record/track_reader.h"
#include "segment.h"

namespace codedexposure::gst
{

/** Which frames of a segment come, and in which order. */
TrackReader::Order order_of (const GstSegment &segment);

/** Reads the lines that come on the track's streaming thread, plain or as Pango
 * markup, and gives each frame its line. */
class TrackSink : public PadBeside<TrackSink>
{
public:
  /* Any thread: */

  /** Lines that could not be read since restart (). */
  guint64 damaged () const { return damaged_; }

  /** Before a run. */
  void restart ();

  /* Streaming thread of the frames: */

  /** The frames reach @p segment; lines before it are forgotten. */
  void next_segment (GstEvent *segment, TrackReader::Order order);
  /** After a flush. */
  void forget ();
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
  friend PadBeside;
  GstFlowReturn chain (GstObject *, BufferPtr buffer);
  void follow (GstEvent *event);
  /** A line, or the end of the track. */
  struct Item {
    guint64 segment;
    std::optional<std::string> text;
    Nanoseconds pts = 0, duration = 0;
  };
  void add (Item item);
  void reach (SegmentCount &which, GstEvent *segment);

  std::atomic<guint64> damaged_ = 0;

  /* The lock: */
  TrackReader reader_;
  std::deque<Item> later_; ///< of segments that the frames have not reached
  bool markup_ = false;    ///< the text is escaped
};

} // namespace codedexposure::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a seek asks of an element that decodes coded frames. */
#pragma once

#include <optional>
#include <string>

#include <gst/gst.h>

#include "raii.h"

namespace codedexposure::gst
{

/** Recordings round times to a microsecond; shorter times are ignored. */
inline constexpr GstClockTime kRounding = 10 * GST_USECOND;

/** Coded frames before and after another on which its pictures depend. */
struct Reach {
  int history = 0;
  int lookahead = 0;
};

/** The coded frames whose times lie in [start, stop), in stream time. */
struct SeekRequest {
  gdouble rate = 1.0;
  GstSeekFlags flags = GST_SEEK_FLAG_NONE;
  GstClockTime start = 0;
  GstClockTime stop = GST_CLOCK_TIME_NONE; ///< none: the end

  /** Of the SEEK event @p seek. @p sink: whose peer knows the duration.
   * @p stop_before: of the seek before, which stays if the event has none. None
   * if the event counts in other units than time, or from where the stream is.
   */
  static std::optional<SeekRequest> parse (
      GstEvent *seek, GstPad *sink, GstClockTime stop_before);
  /** @p seek, with start and stop such that upstream reads what lies in
   * @p reach, too, with no frame cut by the ends. */
  EventPtr widen (GstEvent *seek, Reach reach, GstClockTime period) const;
};

/**
 * Requests by the number of their event, and the reach of elements by the
 * stream that they read, for all elements of the process.
 *
 * A seek reaches each sink by itself: behind a tee, the first one to arrive is
 * widened for all, and its frames reach an element before its own copy of the
 * event does. Any thread.
 */
class SeekBook
{
public:
  /** @p by  the element that takes the request from downstream. */
  static void note (const void *by, guint32 seqnum, const SeekRequest &request);
  /** The request of @p by, else the first one of another element. */
  static std::optional<SeekRequest> find (const void *by, guint32 seqnum);
  /** @p by reads the stream of this id. */
  static void read (const void *by, const std::string &stream, Reach reach);
  static void forget (const void *by);
  /** The largest of the elements that read the same stream as @p by. */
  static Reach reach (const void *by);
};

/** Where a coded frame lies, in the order of playback. */
enum class Place { early, inside, past };

/** A part of a stream that a seek asked for. */
class Excerpt
{
public:
  /** Turns @p segment, upstream's, into that of the excerpt. */
  Excerpt (const SeekRequest &request, GstSegment &segment);

  Place place (GstClockTime pts, GstClockTime period) const;
  /** Widens @p segment to hold the frame, which is inside. Whether it changed.
   */
  bool include (
      GstSegment &segment, GstClockTime pts, GstClockTime period) const;

  /** Its segment went downstream. */
  bool begun = false;

private:
  GstClockTime early_by (GstClockTime period) const;

  SeekRequest request_; ///< in the time of buffers
};

} // namespace codedexposure::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Segments of the frames of a recording. */
#pragma once

#include <algorithm>
#include <mutex>

#include <gst/gst.h>

#include "common/excerpt.h"
#include "common/raii.h"
#include "common/structure.h"

namespace codedexposure::gst
{

/** A seek may end the stream before its last line. @p sink: of the frames. */
inline bool
ends_early (GstPad *sink, const GstSegment &segment)
{
  gint64 duration = 0;
  return GST_CLOCK_TIME_IS_VALID (segment.stop) &&
         gst_pad_peer_query_duration (sink, GST_FORMAT_TIME, &duration) &&
         gst_segment_to_stream_time (&segment, GST_FORMAT_TIME, segment.stop) <
             guint64 (duration);
}

/** PTS at which what a seek asked for ends, without the frames around it. */
inline GstClockTime
end_of_part (const GstSegment &segment, guint32 seqnum)
{
  const auto asked = SeekBook::find (&segment, seqnum);
  const GstClockTime end = asked ? gst_segment_position_from_stream_time (
                                       &segment, GST_FORMAT_TIME, asked->stop)
                                 : GST_CLOCK_TIME_NONE;
  return std::min (end, segment.stop) - kRounding;
}

/** A container rounds times to its ticks, and the time of the stream begins
 * with the rounded one of the first frame, which may be too late by half a
 * tick. */
inline void
include_rounding (GstSegment &segment, guint64 tick)
{
  if (segment.rate > 0 && GST_CLOCK_TIME_IS_VALID (segment.time) &&
      segment.time < segment.start)
    segment.start -= std::min (tick / 2, segment.start - segment.time);
}

/** The segments of a pad. One that repeats the number of its seek only corrects
 * the one before. */
struct SegmentCount {
  guint64 count = 0;
  guint32 seqnum = GST_SEQNUM_INVALID;

  void follow (GstEvent *segment)
  {
    count += gst_event_get_seqnum (segment) != seqnum ? 1 : 0;
    seqnum = gst_event_get_seqnum (segment);
  }
};

/** A pad whose segments are those of the frames, but are reached in another
 * thread. Without a flush, a seek may break the one off at a frame whose line
 * or partner is behind it in the file. */
struct SegmentsBeside {
  SegmentCount own, frames;

  /** That both have reached. */
  guint64 reached () const { return std::min (own.count, frames.count); }
  bool is_ahead () const { return own.count > frames.count; }
};

/** Such a pad of the part restore, which a @p Derived is: it has chain () for
 * buffers and follow () for events, in the streaming thread of the pad. */
template <typename Derived>
class PadBeside
{
public:
  /** @p pad: of the element. */
  void take_over (GstPad *pad)
  {
    pad_ = pad;
    gst_pad_set_element_private (pad, static_cast<Derived *> (this));
    gst_pad_set_chain_function (
        pad, [] (GstPad *own, GstObject *element, GstBuffer *buffer) noexcept {
          return of (own).chain (element, BufferPtr (buffer));
        });
    gst_pad_set_event_function (
        pad, [] (GstPad *own, GstObject *, GstEvent *event) noexcept {
          of (own).follow (EventPtr (event).get ());
          return gboolean (TRUE);
        });
  }
  /** Any thread. */
  bool is_linked () const { return gst_pad_is_linked (pad_); }

protected:
  static Derived &of (GstPad *pad)
  {
    return *static_cast<Derived *> (gst_pad_get_element_private (pad));
  }

  GstPad *pad_ = nullptr;
  std::mutex lock_; ///< of all that follows; never held while pushing
  SegmentsBeside segments_;
};

/** Out of band, downstream: no further frame of a segment is read. A decoder
 * holds the next segment until a frame of it comes. */
struct SegmentLeft {
  static constexpr const char *kName = "codedexposure/segment-left";
  static constexpr GstEventType kType = GST_EVENT_CUSTOM_DOWNSTREAM_OOB;
  guint seqnum = GST_SEQNUM_INVALID; ///< of the segment
  bool backwards = false;
  /** Time in the file of the last frame that was read; none: there was none. */
  std::optional<guint64> last = {};
  CODED_FIELDS (seqnum, backwards, last);

  /** Backwards, the last frame stays in the decoder. @p tolerance: to which
   * @p time is known. */
  bool is_behind (GstClockTime time, GstClockTime tolerance) const
  {
    if (!last || !GST_CLOCK_TIME_IS_VALID (time))
      return true;
    return backwards ? time < *last + tolerance : time > *last + tolerance;
  }
};

inline EventPtr
segment_event (const GstSegment &segment, guint32 seqnum)
{
  EventPtr event (gst_event_new_segment (&segment));
  gst_event_set_seqnum (event.get (), seqnum);
  return event;
}

} // namespace codedexposure::gst

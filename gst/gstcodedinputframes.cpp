/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Which coded frames came: what was lost, corrupted, saturated or ill-timed is
 * counted and said. */
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "gstcodedinput.h"

namespace cexp::gst
{

namespace
{

void
count (GstElement *element, guint64 &counter, guint64 by = 1)
{
  const ObjectLock lock (element);
  counter += by;
}

void
post (GstElement *element, GstStructure *structure)
{
  gst_element_post_message (
      element, gst_message_new_element (GST_OBJECT (element), structure));
}

void
report_loss (GstElement *element, const CodedStream &stream,
    CodedCounters &counters, GstClockTime pts, GstClockTime period,
    guint64 lost)
{
  const GstClockTime last = stream.last_pts;
  const GstClockTime from =
      stream.backwards () ? last - std::min (last, period) : last + period;
  GST_WARNING_OBJECT (element,
      "%" G_GUINT64_FORMAT " coded frames lost from %" GST_TIME_FORMAT
      " to %" GST_TIME_FORMAT,
      lost, GST_TIME_ARGS (from), GST_TIME_ARGS (pts));
  count (element, counters.frames_lost, lost);
  post (element, gst_structure_new ("codedexposure/frames-lost", "count",
                     G_TYPE_UINT64, lost, "from", G_TYPE_UINT64, from, "to",
                     G_TYPE_UINT64, pts, nullptr));
  g_object_notify (G_OBJECT (element), "frames-lost");
}

void
warn_of_wrong_time (GstElement *element, CodedStream &stream, GstClockTime pts,
    GstClockTime period)
{
  if (std::exchange (stream.warned_of_time, true))
    return;
  GST_ELEMENT_WARNING (element, STREAM, FORMAT,
      ("A coded frame at %" GST_TIME_FORMAT " follows one at %" GST_TIME_FORMAT
       ", where frames are %" GST_TIME_FORMAT " apart: what is made of it "
       "overlaps with others in time.",
          GST_TIME_ARGS (pts), GST_TIME_ARGS (stream.last_pts),
          GST_TIME_ARGS (period)),
      ("this is said once"));
}

bool
ends_with_stream (GstPad *sinkpad, GstClockTime stop)
{
  gint64 duration = -1;
  return gst_pad_peer_query_duration (sinkpad, GST_FORMAT_TIME, &duration) &&
         GstClockTime (duration) <= stop + kRounding;
}

void
warn_of_inside (GstPad *sinkpad, const GstSegment &segment)
{
  const ObjectPtr<GstElement> element (gst_pad_get_parent_element (sinkpad));
  GST_ELEMENT_WARNING (element.get (), STREAM, FORMAT,
      ("From %" GST_TIME_FORMAT " to %" GST_TIME_FORMAT
       " there is one coded frame only, or a part of it, and which part is not "
       "known: there is no picture of it. Seek to a longer stretch.",
          GST_TIME_ARGS (segment.start), GST_TIME_ARGS (segment.stop)),
      (nullptr));
}

FrameMeta
describe (GstBuffer *frame, const FrameStep &step)
{
  FrameMeta meta;
  meta.frame = step.number;
  meta.lost_before = step.lost;
  return get_frame_meta (frame).value_or (meta);
}

} // namespace

GstFlowReturn
check_stamp (GstElement *element, const CodedStream &stream, GstBuffer *frame)
{
  if (stream.segment.format != GST_FORMAT_TIME)
    return GST_FLOW_ERROR;
  if (GST_BUFFER_PTS_IS_VALID (frame))
    return GST_FLOW_OK;
  refuse (element,
      "A coded frame has no time stamp (PTS), so what is made of it cannot be "
      "placed in time: let the source set one, for example with "
      "do-timestamp=true.");
  return GST_FLOW_ERROR;
}

BufferPtr
uncut (GstPad *sinkpad, const CodedStream &stream, BufferPtr frame,
    GstClockTime period)
{
  const GstSegment &segment = stream.segment;
  const GstClockTime pts = GST_BUFFER_PTS (frame.get ());
  const GstClockTime duration = GST_BUFFER_DURATION (frame.get ());
  if (!GST_CLOCK_TIME_IS_VALID (duration) || duration + kRounding >= period)
    return frame;
  const bool at_start = pts == segment.start;
  const bool at_stop = pts + duration == segment.stop;
  if ((at_start || at_stop) && duration <= kRounding)
    return nullptr;
  if (!at_start || pts + duration < period)
    return frame;
  if (at_stop && !ends_with_stream (sinkpad, segment.stop)) {
    warn_of_inside (sinkpad, segment);
    return nullptr;
  }
  BufferPtr whole (gst_buffer_make_writable (frame.release ()));
  GST_BUFFER_PTS (whole.get ()) = pts + duration - period;
  GST_BUFFER_DURATION (whole.get ()) = period;
  return whole;
}

Admitted
admit (GstElement *element, CodedStream &stream, CodedCounters &counters,
    GstBuffer *frame, GstClockTime period)
{
  const GstClockTime pts = GST_BUFFER_PTS (frame);
  count (element, counters.frames_in);
  if (GST_BUFFER_FLAG_IS_SET (frame, GST_BUFFER_FLAG_CORRUPTED)) {
    count (element, counters.frames_corrupted);
    g_object_notify (G_OBJECT (element), "frames-corrupted");
  }
  const FrameStep step =
      stream.sequence->take (Nanoseconds (pts), stream.backwards ());
  if (step.arrival == Arrival::after_loss)
    report_loss (element, stream, counters, pts, period, step.lost);
  else if (step.arrival != Arrival::next && step.arrival != Arrival::first)
    warn_of_wrong_time (element, stream, pts, period);
  stream.last_pts = pts;
  const bool after_late =
      std::exchange (stream.was_late, step.arrival == Arrival::late);
  return {describe (frame, step), step.arrival == Arrival::next &&
                                      !after_late &&
                                      !GST_BUFFER_IS_DISCONT (frame)};
}

void
note_saturation (GstElement *element, CodedStream &stream,
    CodedCounters &counters, GstClockTime pts, const FrameMeta &meta)
{
  /* Noise lifts a bright pixel to white in one frame and not in the next. */
  constexpr GstClockTimeDiff kCalm = GST_SECOND;
  Burst &burst = stream.saturation;
  if (meta.saturated == 0) {
    if (burst.frames > 0 && std::abs (GST_CLOCK_DIFF (burst.to, pts)) >= kCalm)
      end_saturation (element, stream);
    return;
  }
  count (element, counters.saturated_frames);
  burst.to = pts;
  burst.peak = std::max (burst.peak, meta.saturated);
  if (burst.frames++ > 0)
    return;
  burst.from = pts;
  post (element,
      gst_structure_new ("codedexposure/saturated", "active", G_TYPE_BOOLEAN,
          TRUE, "frame", G_TYPE_UINT64, meta.frame, "from", G_TYPE_UINT64, pts,
          "pixels", G_TYPE_UINT64, meta.saturated, nullptr));
  g_object_notify (G_OBJECT (element), "saturated-frames");
}

void
end_saturation (GstElement *element, CodedStream &stream)
{
  const Burst burst = std::exchange (stream.saturation, {});
  if (burst.frames == 0)
    return;
  post (
      element, gst_structure_new ("codedexposure/saturated", "active",
                   G_TYPE_BOOLEAN, FALSE, "frames", G_TYPE_UINT64, burst.frames,
                   "from", G_TYPE_UINT64, burst.from, "to", G_TYPE_UINT64,
                   burst.to, "pixels", G_TYPE_UINT64, burst.peak, nullptr));
  g_object_notify (G_OBJECT (element), "saturated-frames");
}

} // namespace cexp::gst

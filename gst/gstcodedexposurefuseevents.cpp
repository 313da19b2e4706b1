/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Events and queries of codedexposure-fuse. */
#include "gstcodedexposurecaps.h"
#include "gstcodedexposurefusestate.h"
#include "gstcodedexposuretag.h"

#define GST_CAT_DEFAULT codedexposure_fuse_debug

namespace cexp::gst::fuse
{

namespace
{

gboolean
forward (GstCodedExposureFuse *self, EventPtr event)
{
  return gst_pad_push_event (state (self).srcpad, event.release ());
}

/* The source pad gets its caps with the first frame, because the schedule may
 * stand in a tag, and tags follow the caps. Until then events wait. */
gboolean
forward_in_turn (GstCodedExposureFuse *self, EventPtr event)
{
  Stream &stream = state (self).stream;
  if (!stream.stale && stream.pending.empty ())
    return forward (self, std::move (event));
  stream.pending.push_back (std::move (event));
  return TRUE;
}

gboolean
on_stream_start (GstCodedExposureFuse *self, EventPtr event)
{
  Stream &stream = state (self).stream;
  settle_pending (self);
  stream.tagged.reset ();
  stream.stale = true;
  return forward (self, std::move (event));
}

gboolean
on_caps (GstCodedExposureFuse *self, const EventPtr &event)
{
  Stream &stream = state (self).stream;
  GstCaps *caps = nullptr;
  gst_event_parse_caps (event.get (), &caps);
  if (!stream.caps || !gst_caps_is_equal (stream.caps.get (), caps))
    stream.stale = true;
  stream.caps.reset (gst_caps_ref (caps));
  return TRUE;
}

/* Makes what comes next a new beginning. */
void
break_time (GstCodedExposureFuse *self)
{
  Stream &stream = state (self).stream;
  forget_history (self);
  if (stream.sequence)
    stream.sequence->resync ();
  stream.discont = true;
}

gboolean
on_segment (GstCodedExposureFuse *self, EventPtr event)
{
  Stream &stream = state (self).stream;
  gst_event_copy_segment (event.get (), &stream.segment);
  if (stream.segment.format != GST_FORMAT_TIME) {
    GST_ELEMENT_ERROR (self, STREAM, FORMAT,
        ("The coded frames come in a segment of format %s: fused frames need "
         "times.",
            gst_format_get_name (stream.segment.format)),
        (nullptr));
    return FALSE;
  }
  break_time (self);
  return forward_in_turn (self, std::move (event));
}

gboolean
on_tag (GstCodedExposureFuse *self, EventPtr event)
{
  Stream &stream = state (self).stream;
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event.get (), &tags);
  if (auto tagged = setup_from_tags (tags)) {
    if (!*tagged || !stream.tagged || !*stream.tagged || !stream.plan ||
        !(tagged->value () == stream.tagged->value ()))
      stream.stale = true;
    stream.tagged = std::move (tagged);
  }
  return forward_in_turn (self, std::move (event));
}

/* A gap stands for a frame, so downstream has to know the caps. */
gboolean
on_gap (GstCodedExposureFuse *self, EventPtr event)
{
  forget_history (self);
  if (!state (self).stream.caps)
    return forward_in_turn (self, std::move (event));
  return negotiate (self) == GST_FLOW_OK && forward (self, std::move (event));
}

/* A stream that ends before its first frame is a stream: a muxer downstream
 * needs its caps. */
gboolean
on_eos (GstCodedExposureFuse *self, EventPtr event)
{
  const Stream &stream = state (self).stream;
  if (stream.caps && !stream.plan)
    negotiate (self);
  settle_pending (self);
  return forward (self, std::move (event));
}

/* A flush takes the segment and what was in flight; the rest of what waits
 * is sticky and stays true. */
gboolean
on_flush_stop (GstCodedExposureFuse *self, EventPtr event)
{
  Stream &stream = state (self).stream;
  std::erase_if (stream.pending, [] (const EventPtr &waiting) {
    return !(gst_event_type_get_flags (GST_EVENT_TYPE (waiting.get ())) &
               GST_EVENT_TYPE_STICKY) ||
           GST_EVENT_TYPE (waiting.get ()) == GST_EVENT_SEGMENT;
  });
  gst_segment_init (&stream.segment, GST_FORMAT_UNDEFINED);
  break_time (self);
  return forward (self, std::move (event));
}

gboolean
answer_caps (GstQuery *query, GstCaps *own)
{
  const CapsPtr answer (own);
  GstCaps *filter = nullptr;
  gst_query_parse_caps (query, &filter);
  const CapsPtr filtered =
      filter ? intersect_caps (filter, answer.get ()) : nullptr;
  gst_query_set_caps_result (query, filtered ? filtered.get () : own);
  return TRUE;
}

/* Pixels are read when a frame comes, whatever their strides. */
gboolean
answer_allocation (GstQuery *query)
{
  gst_query_add_allocation_meta (query, GST_VIDEO_META_API_TYPE, nullptr);
  return TRUE;
}

/* One frame in is n frames out. */
gint64
frames_of (GstCodedExposureFuse *self, gint64 coded)
{
  const ObjectLock lock (self);
  const auto &schedule = state (self).in_force;
  return coded < 0 || !schedule ? coded : coded * schedule->slots ();
}

/* Frames that wait for the next one are late by its period; a fused frame k
 * is due only k slots after its coded frame. The time it computes for is what
 * the processing deadline of sinks stands for. */
void
add_latency (GstCodedExposureFuse *self, GstQuery *query)
{
  gboolean live;
  GstClockTime min, max;
  gst_query_parse_latency (query, &live, &min, &max);
  GstClockTime own;
  {
    const ObjectLock lock (self);
    own = state (self).latency;
  }
  min += own;
  if (GST_CLOCK_TIME_IS_VALID (max))
    max += own;
  gst_query_set_latency (query, live, min, max);
}

/* Whether @p event is one of those that come between frames: what waits goes
 * first. */
bool
is_serialised (GstEvent *event)
{
  return gst_event_type_get_flags (GST_EVENT_TYPE (event)) &
             GST_EVENT_TYPE_SERIALIZED &&
         GST_EVENT_TYPE (event) != GST_EVENT_FLUSH_STOP;
}

} // namespace

gboolean
sink_event (GstPad *pad, GstObject *parent, GstEvent *raw) noexcept
{
  auto *self = GST_CODED_EXPOSURE_FUSE (parent);
  EventPtr event (raw);
  GST_LOG_OBJECT (pad, "%" GST_PTR_FORMAT, raw);
  if (is_serialised (raw))
    drain (self);
  switch (GST_EVENT_TYPE (raw)) {
  case GST_EVENT_STREAM_START:
    return on_stream_start (self, std::move (event));
  case GST_EVENT_CAPS:
    return on_caps (self, event);
  case GST_EVENT_SEGMENT:
    return on_segment (self, std::move (event));
  case GST_EVENT_TAG:
    return on_tag (self, std::move (event));
  case GST_EVENT_GAP:
    return on_gap (self, std::move (event));
  case GST_EVENT_EOS:
    return on_eos (self, std::move (event));
  case GST_EVENT_FLUSH_STOP:
    return on_flush_stop (self, std::move (event));
  default:
    return is_serialised (raw) ? forward_in_turn (self, std::move (event))
                               : forward (self, std::move (event));
  }
}

/* QoS stops here: aravissrc holds its object lock while it waits for a frame,
 * so a sink that reports to it waits too, and loses frames for it. */
gboolean
src_event (GstPad *pad, GstObject *parent, GstEvent *event) noexcept
{
  if (GST_EVENT_TYPE (event) != GST_EVENT_QOS)
    return gst_pad_event_default (pad, parent, event);
  gst_event_unref (event);
  return TRUE;
}

gboolean
sink_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept
{
  switch (GST_QUERY_TYPE (query)) {
  case GST_QUERY_CAPS:
    return answer_caps (query, sink_caps (GST_CODED_EXPOSURE_FUSE (parent)));
  case GST_QUERY_ALLOCATION:
    return answer_allocation (query);
  default:
    return gst_pad_query_default (pad, parent, query);
  }
}

gboolean
src_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept
{
  auto *self = GST_CODED_EXPOSURE_FUSE (parent);
  if (GST_QUERY_TYPE (query) == GST_QUERY_CAPS)
    return answer_caps (query, src_caps (self));
  if (!gst_pad_query_default (pad, parent, query))
    return FALSE;

  GstFormat format;
  gint64 value;
  if (GST_QUERY_TYPE (query) == GST_QUERY_LATENCY) {
    add_latency (self, query);
  } else if (GST_QUERY_TYPE (query) == GST_QUERY_DURATION) {
    gst_query_parse_duration (query, &format, &value);
    if (format == GST_FORMAT_DEFAULT)
      gst_query_set_duration (query, format, frames_of (self, value));
  } else if (GST_QUERY_TYPE (query) == GST_QUERY_POSITION) {
    gst_query_parse_position (query, &format, &value);
    if (format == GST_FORMAT_DEFAULT)
      gst_query_set_position (query, format, frames_of (self, value));
  }
  return TRUE;
}

} // namespace cexp::gst::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Events and queries of all pads. */
#include "gstcodedexposuredemuxstate.h"
#include "gstcodedexposuretag.h"

#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace cexp::gst::demux
{

namespace
{

/* Source pads get their caps with the first frame, because the schedule may
 * stand in a tag, and tags follow the caps. Until then events wait. */
gboolean
forward_in_turn (GstCodedExposureDemux *self, EventPtr event)
{
  Stream &stream = state (self).stream;
  if (!stream.stale && stream.pending.empty ())
    return forward (self, std::move (event));
  stream.pending.push_back (std::move (event));
  return TRUE;
}

gboolean
on_stream_start (GstCodedExposureDemux *self, EventPtr event)
{
  Stream &stream = state (self).stream;
  settle_pending (self);
  stream.tagged.reset ();
  stream.stale = true;
  return forward (self, std::move (event));
}

gboolean
on_caps (GstCodedExposureDemux *self, EventPtr event)
{
  Stream &stream = state (self).stream;
  GstCaps *caps = nullptr;
  gst_event_parse_caps (event.get (), &caps);
  if (!stream.caps || !gst_caps_is_equal (stream.caps.get (), caps))
    stream.stale = true;
  stream.caps.reset (gst_caps_ref (caps));
  stream.caps_seqnum = gst_event_get_seqnum (event.get ());
  return TRUE;
}

void
forget_lateness (GstCodedExposureDemux *self)
{
  const auto list = outputs (self);
  const ObjectLock lock (self);
  list->each ([] (const OutputRef &output) {
    output->earliest = GST_CLOCK_TIME_NONE;
    output->proportion = 1.0;
    output->jitter = 0;
  });
}

/* Makes what comes next a new beginning on every pad. */
void
break_time (GstCodedExposureDemux *self)
{
  Stream &stream = state (self).stream;
  if (stream.sequence)
    stream.sequence->resync ();
  stream.live.reset ();
  forget_lateness (self);
  outputs (self)->each (
      [] (const OutputRef &output) { output->discont = true; });
}

gboolean
on_segment (GstCodedExposureDemux *self, EventPtr event)
{
  Stream &stream = state (self).stream;
  gst_event_copy_segment (event.get (), &stream.segment);
  if (stream.segment.format != GST_FORMAT_TIME) {
    GST_ELEMENT_ERROR (self, STREAM, FORMAT,
        ("The coded frames come in a segment of format %s: subframes need "
         "times.",
            gst_format_get_name (stream.segment.format)),
        (nullptr));
    return FALSE;
  }
  break_time (self);
  return forward_in_turn (self, std::move (event));
}

gboolean
on_tag (GstCodedExposureDemux *self, EventPtr event)
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
on_gap (GstCodedExposureDemux *self, EventPtr event)
{
  if (!state (self).stream.caps)
    return forward_in_turn (self, std::move (event));
  return negotiate (self) == GST_FLOW_OK && forward (self, std::move (event));
}

/* A stream that ends before its first frame is a stream: a muxer downstream
 * needs its caps. */
gboolean
on_eos (GstCodedExposureDemux *self, EventPtr event)
{
  const Stream &stream = state (self).stream;
  end_saturation (self);
  if (stream.caps && !stream.plan)
    negotiate (self);
  settle_pending (self);
  return forward (self, std::move (event));
}

/* A flush takes the segment and what was in flight; the rest of what waits
 * is sticky and stays true. */
gboolean
on_flush_stop (GstCodedExposureDemux *self, EventPtr event)
{
  Stream &stream = state (self).stream;
  std::erase_if (stream.pending, [] (const EventPtr &waiting) {
    return !is_sticky (waiting.get ()) ||
           GST_EVENT_TYPE (waiting.get ()) == GST_EVENT_SEGMENT;
  });
  gst_segment_init (&stream.segment, GST_FORMAT_UNDEFINED);
  end_saturation (self);
  break_time (self);
  const gboolean done = forward (self, std::move (event));
  forget_flow (self);
  return done;
}

/* A sink says how late a buffer was. What ran before that moment could not be
 * in time either. */
void
note_lateness (GstCodedExposureDemux *self, GstPad *pad, GstEvent *event)
{
  GstQOSType type;
  gdouble proportion = 1.0;
  GstClockTimeDiff jitter = 0;
  GstClockTime time = GST_CLOCK_TIME_NONE;
  gst_event_parse_qos (event, &type, &proportion, &jitter, &time);
  const auto list = outputs (self);
  const ObjectLock lock (self);
  list->each ([&] (const OutputRef &output) {
    if (output->pad.get () != pad)
      return;
    output->proportion = proportion;
    output->jitter = jitter;
    output->earliest =
        GST_CLOCK_TIME_IS_VALID (time)
            ? GstClockTime (std::max<gint64> (gint64 (time) + jitter, 0))
            : GST_CLOCK_TIME_NONE;
  });
}

gboolean
answer_caps (GstQuery *query, GstCaps *own)
{
  const CapsPtr answer (own);
  GstCaps *filter = nullptr;
  gst_query_parse_caps (query, &filter);
  if (!filter) {
    gst_query_set_caps_result (query, answer.get ());
    return TRUE;
  }
  const CapsPtr filtered (gst_caps_intersect_full (
      filter, answer.get (), GST_CAPS_INTERSECT_FIRST));
  gst_query_set_caps_result (query, filtered.get ());
  return TRUE;
}

/* The raised pad has n frames where upstream counts one. */
gint64
subframes_of (GstCodedExposureDemux *self, GstPad *pad, gint64 frames)
{
  const auto list = outputs (self);
  const ObjectLock lock (self);
  const ScheduleRef &schedule = state (self).in_force;
  const bool raised = list->all->pad.get () == pad && schedule;
  return frames < 0 || !raised ? frames : frames * schedule->slots ();
}

} // namespace

gboolean
sink_event (GstPad *pad, GstObject *parent, GstEvent *raw) noexcept
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (parent);
  EventPtr event (raw);
  GST_LOG_OBJECT (pad, "%" GST_PTR_FORMAT, raw);
  switch (GST_EVENT_TYPE (raw)) {
  case GST_EVENT_STREAM_START:
    return on_stream_start (self, std::move (event));
  case GST_EVENT_CAPS:
    return on_caps (self, std::move (event));
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
    return gst_event_type_get_flags (GST_EVENT_TYPE (raw)) &
                   GST_EVENT_TYPE_SERIALIZED
               ? forward_in_turn (self, std::move (event))
               : forward (self, std::move (event));
  }
}

/* QoS stops here: aravissrc holds its object lock while it waits for a frame,
 * so a sink that reports to it waits too, and loses frames for it. */
gboolean
src_event (GstPad *pad, GstObject *parent, GstEvent *raw) noexcept
{
  if (GST_EVENT_TYPE (raw) != GST_EVENT_QOS)
    return gst_pad_event_default (pad, parent, raw);
  const EventPtr event (raw);
  note_lateness (GST_CODED_EXPOSURE_DEMUX (parent), pad, raw);
  return TRUE;
}

gboolean
sink_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (parent);
  switch (GST_QUERY_TYPE (query)) {
  case GST_QUERY_CAPS: {
    return answer_caps (query, sink_caps (self));
  }
  case GST_QUERY_ALLOCATION:
    return answer_allocation (self, query);
  default:
    return gst_pad_query_default (pad, parent, query);
  }
}

/* LATENCY is upstream's own: the demultiplexer holds no frame back, and
 * subframe k is due k slots after its frame. The time it computes for is what
 * the processing deadline of sinks stands for. */
gboolean
src_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (parent);
  if (GST_QUERY_TYPE (query) == GST_QUERY_CAPS)
    return answer_caps (query, src_caps (self, pad));
  if (!gst_pad_query_default (pad, parent, query))
    return FALSE;

  GstFormat format;
  gint64 value;
  if (GST_QUERY_TYPE (query) == GST_QUERY_DURATION) {
    gst_query_parse_duration (query, &format, &value);
    if (format == GST_FORMAT_DEFAULT)
      gst_query_set_duration (query, format, subframes_of (self, pad, value));
  } else if (GST_QUERY_TYPE (query) == GST_QUERY_POSITION) {
    gst_query_parse_position (query, &format, &value);
    if (format == GST_FORMAT_DEFAULT)
      gst_query_set_position (query, format, subframes_of (self, pad, value));
  }
  return TRUE;
}

} // namespace cexp::gst::demux

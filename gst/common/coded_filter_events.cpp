/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* GstCodedFilter: events and queries. */
#include "coded_filter.h"

#include <algorithm>
#include <utility>

#include "events.h"
#include "tag.h"

#define GST_CAT_DEFAULT coded_filter_debug

namespace codedexposure::gst
{

namespace
{

bool
has_flag (const EventPtr &event, GstEventTypeFlags flag)
{
  return gst_event_type_get_flags (GST_EVENT_TYPE (event.get ())) & flag;
}

} // namespace

/* Source pads get their caps with the first frame, because the schedule may
 * come in a tag, and tags follow the caps. Other events wait until then. */
gboolean
CodedFilter::sink_event (EventPtr event)
{
  GST_LOG_OBJECT (sinkpad_, "%" GST_PTR_FORMAT, event.get ());
  const GstEventType type = GST_EVENT_TYPE (event.get ());
  const bool in_turn = has_flag (event, GST_EVENT_TYPE_SERIALIZED);
  if (type == GST_EVENT_FLUSH_START)
    cancel ();
  if (type == GST_EVENT_FLUSH_STOP)
    resume ();
  else if (in_turn)
    drain ();
  switch (type) {
  case GST_EVENT_STREAM_START:
    return on_stream_start (std::move (event));
  case GST_EVENT_CAPS:
    return on_caps (event);
  case GST_EVENT_SEGMENT:
    return on_segment (std::move (event));
  case GST_EVENT_TAG:
    return on_tag (std::move (event));
  case GST_EVENT_GAP:
    return on_gap (std::move (event));
  case GST_EVENT_SEGMENT_DONE:
    return on_segment_done (std::move (event));
  case GST_EVENT_EOS:
    return on_eos (std::move (event));
  case GST_EVENT_FLUSH_STOP:
    return on_flush_stop (std::move (event));
  case GST_EVENT_CUSTOM_DOWNSTREAM_STICKY:
    stream_.is_recorded |= gst_event_has_name (event.get (), kRecordedEvent);
    [[fallthrough]];
  default:
    return in_turn ? forward_in_turn (std::move (event))
                   : forward (std::move (event));
  }
}

/* Forwards the events that waited for the caps. If there were none, the stream
 * ends with its tags and with what is not sticky; the segment and others may
 * come only once, and still hold for the stream that follows. */
void
CodedFilter::settle_events ()
{
  if (!has_format ()) {
    std::erase_if (stream_.pending, [] (const EventPtr &waiting) {
      return !has_flag (waiting, GST_EVENT_TYPE_STICKY) ||
             GST_EVENT_TYPE (waiting.get ()) == GST_EVENT_TAG;
    });
    return;
  }
  if (stream_.excerpt)
    stream_.excerpt->begun = true;
  for (EventPtr &event : std::exchange (stream_.pending, {})) {
    if (GST_EVENT_TYPE (event.get ()) == GST_EVENT_SEGMENT)
      event = segment_event ();
    if (GST_EVENT_TYPE (event.get ()) == GST_EVENT_TAG &&
        takes_provenance (event.get ()))
      stream_.provenance_due = false;
    forward (std::move (event));
  }
}

/* Muxers need caps even if no frame came. */
void
CodedFilter::settle_at_end ()
{
  if (stream_.caps && !has_format ())
    negotiate ();
  settle_events ();
}

gboolean
CodedFilter::forward_in_turn (EventPtr event)
{
  if (!stream_.stale && stream_.pending.empty ())
    return forward (std::move (event));
  stream_.pending.push_back (std::move (event));
  return TRUE;
}

gboolean
CodedFilter::on_stream_start (EventPtr event)
{
  settle_events ();
  /* A pad whose offset changes sends its events again, but not always the tags
   * that came at the same moment. */
  const gchar *id = nullptr;
  gst_event_parse_stream_start (event.get (), &id);
  if (std::exchange (stream_.id, id ? id : "") != (id ? id : "")) {
    stream_.tagged.reset ();
    stream_.not_coded.reset ();
    stream_.is_recorded = false;
    stream_.stale = true;
  }
  SeekBook::read (this, stream_.id, reach ());
  return forward (std::move (event));
}

gboolean
CodedFilter::on_caps (const EventPtr &event)
{
  GstCaps *caps = caps_of (event.get ());
  if (!stream_.caps || !gst_caps_is_equal (stream_.caps.get (), caps))
    stream_.stale = true;
  stream_.caps.reset (gst_caps_ref (caps));
  stream_.caps_seqnum = gst_event_get_seqnum (event.get ());
  return TRUE;
}

gboolean
CodedFilter::on_segment (EventPtr event)
{
  gst_event_copy_segment (event.get (), &stream_.upstream);
  if (!counts_time (element_, stream_.upstream)) {
    stream_.end_segment ();
    return FALSE;
  }
  break_time ();
  std::erase_if (stream_.pending, [] (const EventPtr &waiting) {
    return GST_EVENT_TYPE (waiting.get ()) == GST_EVENT_SEGMENT;
  });
  stream_.segment_seqnum = gst_event_get_seqnum (event.get ());
  const auto request = SeekBook::find (this, stream_.segment_seqnum);
  if (request && request->rate == stream_.upstream.rate &&
      stream_.upstream.applied_rate == 1.0) {
    begin_excerpt (*request);
    stream_.pending.push_back (std::move (event));
    return TRUE;
  }
  stream_.excerpt.reset ();
  stream_.segment = stream_.upstream;
  return forward_in_turn (std::move (event));
}

/* Downstream gets the segment that it asked for, with the first frame. Without
 * a flush its running time goes on from the excerpt before, because upstream's
 * contains frames that were only read. */
void
CodedFilter::begin_excerpt (const SeekRequest &request)
{
  const GstSegment before = stream_.segment;
  const bool goes_on = stream_.excerpt && stream_.upstream.base > 0;
  stream_.segment = stream_.upstream;
  stream_.excerpt.emplace (request, stream_.segment);
  if (goes_on)
    stream_.segment.base =
        gst_segment_to_running_time (&before, GST_FORMAT_TIME,
            std::clamp (before.position, before.start, before.stop));
}

EventPtr
CodedFilter::segment_event () const
{
  EventPtr event (gst_event_new_segment (&stream_.segment));
  gst_event_set_seqnum (event.get (), stream_.segment_seqnum);
  return event;
}

gboolean
CodedFilter::on_tag (EventPtr event)
{
  GstTagList *tags = tags_of (event.get ());
  if (auto why = why_not_coded (event.get ())) {
    stream_.not_coded = std::move (why);
    stream_.stale = true;
  }
  if (auto tagged = setup_from_tags (tags)) {
    if (!*tagged || !stream_.tagged || !*stream_.tagged || !has_format () ||
        !(tagged->value () == stream_.tagged->value ()))
      stream_.stale = true;
    stream_.tagged = std::move (tagged);
  }
  return forward_in_turn (std::move (event));
}

/* A gap replaces a frame, so downstream needs the caps first. */
gboolean
CodedFilter::on_gap (EventPtr event)
{
  break_history ();
  note_missing (event.get ());
  if (!stream_.caps)
    return forward_in_turn (std::move (event));
  if (negotiate () != GST_FLOW_OK)
    return FALSE;
  if (!stream_.excerpt)
    return forward (std::move (event));
  GstClockTime pts, duration;
  gst_event_parse_gap (event.get (), &pts, &duration);
  const GstClockTime end =
      GST_CLOCK_TIME_IS_VALID (duration) ? pts + duration : duration;
  guint64 from, to;
  if (!gst_segment_clip (
          &stream_.segment, GST_FORMAT_TIME, pts, end, &from, &to))
    return TRUE;
  settle_events ();
  return forward (gap_like (
      event.get (), from, GST_CLOCK_TIME_IS_VALID (to) ? to - from : to));
}

/* Upstream read beyond the end. */
gboolean
CodedFilter::on_segment_done (EventPtr event)
{
  settle_at_end ();
  GstSegment &segment = stream_.segment;
  const GstClockTime end = segment.rate > 0 ? segment.stop : segment.start;
  if (stream_.excerpt && GST_CLOCK_TIME_IS_VALID (end)) {
    segment.position = end;
    EventPtr own (gst_event_new_segment_done (GST_FORMAT_TIME, gint64 (end)));
    gst_event_set_seqnum (own.get (), gst_event_get_seqnum (event.get ()));
    event = std::move (own);
  }
  return forward (std::move (event));
}

gboolean
CodedFilter::on_eos (EventPtr event)
{
  end_saturation ();
  settle_at_end ();
  return forward (std::move (event));
}

/* A flush drops the segment and events that are not sticky. Other sticky events
 * that wait stay valid. */
gboolean
CodedFilter::on_flush_stop (EventPtr event)
{
  std::erase_if (stream_.pending, [] (const EventPtr &waiting) {
    return !has_flag (waiting, GST_EVENT_TYPE_STICKY) ||
           GST_EVENT_TYPE (waiting.get ()) == GST_EVENT_SEGMENT;
  });
  stream_.end_segment ();
  end_saturation ();
  break_time ();
  const gboolean done = forward (std::move (event));
  flushed ();
  const ObjectLock lock (element_);
  gst_flow_combiner_reset (combiner_.get ());
  return done;
}

void
CodedFilter::break_time ()
{
  if (stream_.sequence)
    stream_.sequence->resync ();
  stream_.moved.reset ();
  stream_.missing_until = 0;
  stream_.before = {};
  break_history ();
  each_pad ([this] (GstCodedPad *pad) {
    pad->state.discont = true;
    const ObjectLock lock (element_);
    forget_lateness (pad);
  });
}

/* QoS events stop here: aravissrc holds its object lock while it waits for a
 * frame, so a sink that sends it an event would wait, too, and lose frames. */
gboolean
CodedFilter::src_event (GstCodedPad *pad, GstEvent *event)
{
  EventPtr owned (event);
  if (GST_EVENT_TYPE (event) == GST_EVENT_SEEK)
    return seek (std::move (owned));
  if (GST_EVENT_TYPE (event) != GST_EVENT_QOS)
    return gst_pad_event_default (
        GST_PAD (pad), GST_OBJECT (element_), owned.release ());
  const ObjectLock lock (element_);
  note_lateness (pad, event);
  return TRUE;
}

/* Upstream reads the frames around those that are asked for, too. Each of
 * several pads gets the same seek. */
gboolean
CodedFilter::seek (EventPtr event)
{
  const guint32 seqnum = gst_event_get_seqnum (event.get ());
  GstClockTime stop;
  {
    const ObjectLock lock (element_);
    if (std::exchange (shared_.last_seek, seqnum) == seqnum)
      return TRUE;
    stop = shared_.stop_asked;
  }
  const auto request = SeekRequest::parse (event.get (), sinkpad_, stop);
  if (request) {
    SeekBook::note (this, seqnum, *request);
    event = request->widen (
        event.get (), SeekBook::reach (this), period_for_seek ());
  }
  GST_DEBUG_OBJECT (element_, "%" GST_PTR_FORMAT, event.get ());
  const gboolean done = gst_pad_push_event (sinkpad_, event.release ());
  const ObjectLock lock (element_);
  if (!done)
    shared_.last_seek = GST_SEQNUM_INVALID;
  else if (request)
    shared_.stop_asked = request->stop;
  return done;
}

/* By the caps, if there was no frame yet; a long one, if they have no rate. */
GstClockTime
CodedFilter::period_for_seek () const
{
  FrameRate rate;
  {
    const ObjectLock lock (element_);
    if (shared_.period > 0)
      return shared_.period;
    rate = shared_.settings.rate;
  }
  const CapsPtr caps (gst_pad_get_current_caps (sinkpad_));
  const CapsPtr filled = caps ? fill_in_rate (rate, caps.get ()) : nullptr;
  GstVideoInfo info;
  if (!filled || !gst_video_info_from_caps (&info, filled.get ()) ||
      info.fps_n == 0)
    return GST_SECOND;
  return GstClockTime (FrameRate{info.fps_n, info.fps_d}.period ());
}

/* --------------------------------------------------------------- queries -- */

gboolean
CodedFilter::sink_query (GstQuery *query)
{
  switch (GST_QUERY_TYPE (query)) {
  case GST_QUERY_CAPS:
    answer_caps (query, sink_caps ());
    return TRUE;
  case GST_QUERY_ALLOCATION:
    return answer_allocation (query);
  default:
    return gst_pad_query_default (sinkpad_, GST_OBJECT (element_), query);
  }
}

/* Picture k is due k slots after its coded frame, which adds no latency. The
 * processing deadline of sinks covers the time for computing. */
gboolean
CodedFilter::src_query (GstCodedPad *pad, GstQuery *query)
{
  if (GST_QUERY_TYPE (query) == GST_QUERY_CAPS) {
    answer_caps (query, src_caps (pad));
    return TRUE;
  }
  if (!gst_pad_query_default (GST_PAD (pad), GST_OBJECT (element_), query))
    return FALSE;
  if (GST_QUERY_TYPE (query) == GST_QUERY_LATENCY) {
    const ObjectLock lock (element_);
    add_latency (query, shared_.latency);
  }
  scale_frames (pad, query);
  return TRUE;
}

/* The schedule of the property, else the one in force. A default schedule does
 * not restrict caps, because the tag may still come. */
CodedFilter::CapsContext
CodedFilter::caps_context () const
{
  const ObjectLock lock (element_);
  const auto &asked = shared_.settings.schedule.read;
  ScheduleRef schedule = shared_.assumed ? nullptr : shared_.schedule;
  if (asked && *asked)
    schedule = {asked, &asked->value ()};
  return {schedule, shared_.settings.rate,
      shared_.settings.mapping.read || shared_.rectifies};
}

CapsPtr
CodedFilter::caps_between (const CapsContext &context, const GstCodedPad *pad,
    GstCaps *caps, bool to_coded) const
{
  return pad->state.kind == PadKind::coded
             ? CapsPtr (gst_caps_ref (caps))
             : convert_caps (context, pad, caps, to_coded);
}

CapsPtr
CodedFilter::convert_caps (const CapsContext &context, const GstCodedPad *pad,
    GstCaps *caps, bool to_coded) const
{
  if (!context.schedule)
    return unbind_caps (caps);
  const CapsScale scale = scale_for (*context.schedule, pad);
  CapsPtr scaled (scale_caps (caps, to_coded ? scale.inverse () : scale));
  return context.mapped ? without_fields (scaled.get (), {"width", "height"})
                        : std::move (scaled);
}

/* A pad that is not linked restricts nothing: without a peer, the answer is
 * ANY. */
CapsPtr
CodedFilter::sink_caps () const
{
  const CapsContext context = caps_context ();
  CapsPtr caps (gst_pad_get_pad_template_caps (sinkpad_));
  each_pad ([&] (GstCodedPad *pad) {
    const CapsPtr peer (gst_pad_peer_query_caps (GST_PAD (pad), nullptr));
    const CapsPtr coded = caps_between (context, pad, peer.get (), true);
    caps = intersect_caps (coded.get (), caps.get ());
  });
  return admit_unknown_rate (context.rate, std::move (caps));
}

CapsPtr
CodedFilter::src_caps (GstCodedPad *pad) const
{
  const CapsContext context = caps_context ();
  const CapsPtr templ (gst_pad_get_pad_template_caps (GST_PAD (pad)));
  const CapsPtr peer (gst_pad_peer_query_caps (sinkpad_, nullptr));
  const CapsPtr taken (gst_pad_get_pad_template_caps (sinkpad_));
  const CapsPtr coded = intersect_caps (peer.get (), taken.get ());
  const CapsPtr filled = fill_in_rate (context.rate, coded.get ());
  const CapsPtr own = caps_between (context, pad, filled.get (), false);
  return intersect_caps (own.get (), templ.get ());
}

/* The coded pad forwards upstream's memory, so the strides must be readable by
 * that pad's peer as well. */
gboolean
CodedFilter::answer_allocation (GstQuery *query) const
{
  GstCaps *caps = nullptr;
  gst_query_parse_allocation (query, &caps, nullptr);
  GstVideoInfo info;
  if (!caps || !gst_video_info_from_caps (&info, caps))
    return FALSE;

  const auto served = pads ();
  auto *coded = GST_PAD_CAST (find_pad (*served, PadKind::coded));
  if (!coded || !is_wanted (coded) || peer_reads_video_meta (coded, caps))
    gst_query_add_allocation_meta (query, GST_VIDEO_META_API_TYPE, nullptr);

  const ObjectPtr<GstBufferPool> pool (gst_video_buffer_pool_new ());
  GstStructure *config = gst_buffer_pool_get_config (pool.get ());
  const guint size = guint (GST_VIDEO_INFO_SIZE (&info));
  gst_buffer_pool_config_set_params (config, caps, size, 0, 0);
  if (gst_buffer_pool_set_config (pool.get (), config))
    gst_query_add_allocation_pool (query, pool.get (), size, 0, 0);
  return TRUE;
}

/* DURATION and POSITION count upstream's frames; @pad has several for each. */
void
CodedFilter::scale_frames (GstCodedPad *pad, GstQuery *query) const
{
  const bool duration = GST_QUERY_TYPE (query) == GST_QUERY_DURATION;
  if (!duration && GST_QUERY_TYPE (query) != GST_QUERY_POSITION)
    return;
  GstFormat format;
  gint64 frames;
  if (duration)
    gst_query_parse_duration (query, &format, &frames);
  else
    gst_query_parse_position (query, &format, &frames);
  if (format != GST_FORMAT_DEFAULT || frames < 0)
    return;
  locked (element_, [&] {
    if (shared_.schedule && pad->state.kind != PadKind::coded)
      frames *= pictures_a_frame (pad);
  });
  if (duration)
    gst_query_set_duration (query, format, frames);
  else
    gst_query_set_position (query, format, frames);
}

} // namespace codedexposure::gst

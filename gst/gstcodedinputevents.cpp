/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Events and queries of coded frames, which every element takes alike. */
#include <utility>

#include "gstcodedexposuretag.h"
#include "gstcodedinput.h"

namespace cexp::gst
{

namespace
{

bool
has_flag (const EventPtr &event, GstEventTypeFlags flag)
{
  return gst_event_type_get_flags (GST_EVENT_TYPE (event.get ())) & flag;
}

} // namespace

void
answer_caps (GstQuery *query, GstCaps *own)
{
  const CapsPtr answer (own);
  GstCaps *filter = nullptr;
  gst_query_parse_caps (query, &filter);
  const CapsPtr filtered =
      filter ? intersect_caps (filter, answer.get ()) : nullptr;
  gst_query_set_caps_result (query, filtered ? filtered.get () : own);
}

void
scale_frames (GstQuery *query, int times)
{
  GstFormat format;
  gint64 frames;
  if (GST_QUERY_TYPE (query) == GST_QUERY_DURATION) {
    gst_query_parse_duration (query, &format, &frames);
    if (format == GST_FORMAT_DEFAULT && frames >= 0)
      gst_query_set_duration (query, format, frames * times);
  } else if (GST_QUERY_TYPE (query) == GST_QUERY_POSITION) {
    gst_query_parse_position (query, &format, &frames);
    if (format == GST_FORMAT_DEFAULT && frames >= 0)
      gst_query_set_position (query, format, frames * times);
  }
}

gboolean
CodedEvents::handle (EventPtr event)
{
  const GstEventType type = GST_EVENT_TYPE (event.get ());
  const bool in_turn = has_flag (event, GST_EVENT_TYPE_SERIALIZED);
  if (in_turn && type != GST_EVENT_FLUSH_STOP)
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
  case GST_EVENT_EOS:
    return on_eos (std::move (event));
  case GST_EVENT_FLUSH_STOP:
    return on_flush_stop (std::move (event));
  default:
    return in_turn ? forward_in_turn (std::move (event))
                   : forward (std::move (event));
  }
}

void
CodedEvents::settle ()
{
  for (EventPtr &event : std::exchange (stream_.pending, {})) {
    if (has_plan ())
      forward (std::move (event));
  }
}

gboolean
CodedEvents::forward_in_turn (EventPtr event)
{
  if (!stream_.stale && stream_.pending.empty ())
    return forward (std::move (event));
  stream_.pending.push_back (std::move (event));
  return TRUE;
}

gboolean
CodedEvents::on_stream_start (EventPtr event)
{
  settle ();
  stream_.tagged.reset ();
  stream_.stale = true;
  return forward (std::move (event));
}

gboolean
CodedEvents::on_caps (const EventPtr &event)
{
  GstCaps *caps = nullptr;
  gst_event_parse_caps (event.get (), &caps);
  if (!stream_.caps || !gst_caps_is_equal (stream_.caps.get (), caps))
    stream_.stale = true;
  stream_.caps.reset (gst_caps_ref (caps));
  stream_.caps_seqnum = gst_event_get_seqnum (event.get ());
  return TRUE;
}

gboolean
CodedEvents::on_segment (EventPtr event)
{
  gst_event_copy_segment (event.get (), &stream_.segment);
  if (stream_.segment.format != GST_FORMAT_TIME) {
    refuse (element_,
        std::string ("The coded frames come in a segment of format ") +
            gst_format_get_name (stream_.segment.format) +
            ": what is made of them needs times.");
    return FALSE;
  }
  break_time ();
  return forward_in_turn (std::move (event));
}

gboolean
CodedEvents::on_tag (EventPtr event)
{
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event.get (), &tags);
  if (auto tagged = setup_from_tags (tags)) {
    if (!*tagged || !stream_.tagged || !*stream_.tagged || !has_plan () ||
        !(tagged->value () == stream_.tagged->value ()))
      stream_.stale = true;
    stream_.tagged = std::move (tagged);
  }
  return forward_in_turn (std::move (event));
}

/* A gap stands for a frame, so downstream has to know the caps. */
gboolean
CodedEvents::on_gap (EventPtr event)
{
  gap ();
  if (!stream_.caps)
    return forward_in_turn (std::move (event));
  return negotiate () && forward (std::move (event));
}

/* A stream that ends before its first frame is a stream: a muxer downstream
 * needs its caps. */
gboolean
CodedEvents::on_eos (EventPtr event)
{
  end ();
  if (stream_.caps && !has_plan ())
    negotiate ();
  settle ();
  return forward (std::move (event));
}

/* A flush takes the segment and what was in flight; the rest of what waits
 * is sticky and stays true. */
gboolean
CodedEvents::on_flush_stop (EventPtr event)
{
  std::erase_if (stream_.pending, [] (const EventPtr &waiting) {
    return !has_flag (waiting, GST_EVENT_TYPE_STICKY) ||
           GST_EVENT_TYPE (waiting.get ()) == GST_EVENT_SEGMENT;
  });
  gst_segment_init (&stream_.segment, GST_FORMAT_UNDEFINED);
  end ();
  break_time ();
  const gboolean done = forward (std::move (event));
  flushed ();
  return done;
}

} // namespace cexp::gst

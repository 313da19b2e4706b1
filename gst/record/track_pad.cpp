/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "track_pad.h"

#include <utility>

namespace codedexposure::gst
{

GstPad *
TrackPad::request (GstPadTemplate *templ)
{
  GstPad *pad = gst_pad_new_from_template (templ, "track");
  gst_pad_use_fixed_caps (pad);
  return pad_.add (pad);
}

void
TrackPad::restart (bool stream)
{
  segment_sent_ = false;
  if (stream)
    stream_sent_ = false;
}

void
TrackPad::start (GstPad *pad, const GstSegment &segment)
{
  if (!std::exchange (stream_sent_, true)) {
    const CharPtr id (gst_pad_create_stream_id (pad, element_, "track"));
    GstEvent *stream = gst_event_new_stream_start (id.get ());
    gst_event_set_stream_flags (stream, GST_STREAM_FLAG_SPARSE);
    gst_pad_push_event (pad, stream);
    const CapsPtr caps (gst_pad_get_pad_template_caps (pad));
    gst_pad_push_event (pad, gst_event_new_caps (caps.get ()));
  }
  if (!std::exchange (segment_sent_, true))
    gst_pad_push_event (pad, gst_event_new_segment (&segment));
}

GstFlowReturn
TrackPad::push (const std::string &text, GstClockTime pts,
    GstClockTime duration, const GstSegment &segment)
{
  const auto to = pad_.get ();
  if (!to)
    return GST_FLOW_OK;
  start (to.get (), segment);
  GstBuffer *buffer = gst_buffer_new_memdup (text.data (), text.size ());
  GST_BUFFER_PTS (buffer) = pts;
  GST_BUFFER_DURATION (buffer) = duration;
  const GstFlowReturn flow = gst_pad_push (to.get (), buffer);
  return flow == GST_FLOW_NOT_LINKED ? GST_FLOW_OK : flow;
}

void
TrackPad::forward (GstEvent *event)
{
  if (const auto to = pad_.get ())
    gst_pad_push_event (to.get (), gst_event_ref (event));
}

} // namespace codedexposure::gst

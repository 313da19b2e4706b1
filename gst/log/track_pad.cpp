/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "track_pad.h"

#include <utility>

namespace codedexposure::gst
{

GstPad *
TrackPad::request (GstPadTemplate *templ, const gchar *)
{
  ObjectPtr<GstPad> pad (GST_PAD (
      gst_object_ref_sink (gst_pad_new_from_template (templ, "track"))));
  {
    const ObjectLock lock (element_);
    if (pad_)
      return nullptr;
    pad_ = pad.get ();
  }
  gst_pad_use_fixed_caps (pad.get ());
  gst_pad_set_active (pad.get (), TRUE);
  gst_element_add_pad (element_, pad.get ());
  return pad.get ();
}

void
TrackPad::release (GstPad *pad)
{
  {
    const ObjectLock lock (element_);
    if (pad_ != pad)
      return;
    pad_ = nullptr;
  }
  gst_pad_set_active (pad, FALSE);
  gst_element_remove_pad (element_, pad);
}

ObjectPtr<GstPad>
TrackPad::pad () const
{
  const ObjectLock lock (element_);
  return ObjectPtr<GstPad> (pad_ ? GST_PAD (gst_object_ref (pad_)) : nullptr);
}

bool
TrackPad::exists () const
{
  return pad () != nullptr;
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
  const auto to = pad ();
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
  if (const auto to = pad ())
    gst_pad_push_event (to.get (), gst_event_ref (event));
}

} // namespace codedexposure::gst

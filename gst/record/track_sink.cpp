/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "track_sink.h"

GST_DEBUG_CATEGORY_EXTERN (codedexposure_restore_debug);
#define GST_CAT_DEFAULT codedexposure_restore_debug

namespace codedexposure::gst
{

namespace
{

TrackSink &
sink_of (GstPad *pad)
{
  return *static_cast<TrackSink *> (gst_pad_get_element_private (pad));
}

} // namespace

TrackReader::Order
order_of (const GstSegment &segment)
{
  constexpr guint kTricks = GST_SEGMENT_FLAG_TRICKMODE |
                            GST_SEGMENT_FLAG_TRICKMODE_KEY_UNITS |
                            GST_SEGMENT_FLAG_TRICKMODE_FORWARD_PREDICTED;
  if (segment.rate < 0)
    return TrackReader::Order::backwards;
  return segment.flags & kTricks ? TrackReader::Order::some
                                 : TrackReader::Order::all;
}

/* ------------------------------------------------------------------- pad -- */

void
TrackSink::take_over (GstPad *pad)
{
  pad_ = pad;
  gst_pad_set_element_private (pad, this);
  gst_pad_set_chain_function (pad, chain);
  gst_pad_set_event_function (pad, event);
}

/* --------------------------------------------------- thread of the track -- */

GstFlowReturn
TrackSink::chain (GstPad *pad, GstObject *parent, GstBuffer *buffer) noexcept
{
  TrackSink &self = sink_of (pad);
  const BufferPtr owned (buffer);
  GstMapInfo map;
  if (!gst_buffer_map (buffer, &map, GST_MAP_READ))
    return GST_FLOW_ERROR;
  const std::string text (reinterpret_cast<const char *> (map.data), map.size);
  gst_buffer_unmap (buffer, &map);

  const auto time_of = [] (GstClockTime time) {
    return GST_CLOCK_TIME_IS_VALID (time) ? Nanoseconds (time) : 0;
  };
  const auto added = self.add (text, time_of (GST_BUFFER_PTS (buffer)),
      time_of (GST_BUFFER_DURATION (buffer)));
  if (!added) {
    GST_WARNING_OBJECT (parent, "%s", added.error ().message.c_str ());
    ++self.damaged_;
  }
  return GST_FLOW_OK;
}

gboolean
TrackSink::event (GstPad *pad, GstObject *, GstEvent *owned) noexcept
{
  TrackSink &self = sink_of (pad);
  const EventPtr event (owned);
  const std::lock_guard lock (self.lock_);
  switch (GST_EVENT_TYPE (event.get ())) {
  case GST_EVENT_CAPS: {
    GstCaps *caps = caps_of (event.get ());
    const GstStructure *structure = gst_caps_get_structure (caps, 0);
    self.markup_ = g_strcmp0 (gst_structure_get_string (structure, "format"),
                       "pango-markup") == 0;
    break;
  }
  case GST_EVENT_FLUSH_STOP:
    self.reader_.clear ();
    break;
  case GST_EVENT_EOS:
    self.reader_.end ();
    break;
  default:
    break;
  }
  return TRUE;
}

Result<void>
TrackSink::add (const std::string &text, Nanoseconds pts, Nanoseconds duration)
{
  const std::lock_guard lock (lock_);
  return reader_.add (markup_ ? unescape_markup (text) : text, pts, duration);
}

/* -------------------------------------------------- thread of the frames -- */

void
TrackSink::restart ()
{
  damaged_ = 0;
  const std::lock_guard lock (lock_);
  reader_ = {};
}

} // namespace codedexposure::gst

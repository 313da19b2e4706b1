/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The part restore: the lines of the text track. */
#include <utility>

#include "restore.h"

GST_DEBUG_CATEGORY_EXTERN (codedexposure_restore_debug);
#define GST_CAT_DEFAULT codedexposure_restore_debug

namespace codedexposure::gst
{

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

/* --------------------------------------------------- thread of the track -- */

GstFlowReturn
TrackSink::chain (GstObject *, BufferPtr buffer)
{
  GstMapInfo map;
  if (!gst_buffer_map (buffer.get (), &map, GST_MAP_READ))
    return GST_FLOW_ERROR;
  const std::string text (reinterpret_cast<const char *> (map.data), map.size);
  gst_buffer_unmap (buffer.get (), &map);

  const auto time_of = [] (GstClockTime time) {
    return GST_CLOCK_TIME_IS_VALID (time) ? Nanoseconds (time) : 0;
  };
  const std::lock_guard lock (lock_);
  add ({segments_.own.count, markup_ ? unescape_markup (text) : text,
      time_of (GST_BUFFER_PTS (buffer.get ())),
      time_of (GST_BUFFER_DURATION (buffer.get ()))});
  return GST_FLOW_OK;
}

void
TrackSink::follow (GstEvent *event)
{
  const std::lock_guard lock (lock_);
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_CAPS: {
    const GstStructure *structure = gst_caps_get_structure (caps_of (event), 0);
    markup_ = g_strcmp0 (gst_structure_get_string (structure, "format"),
                  "pango-markup") == 0;
    break;
  }
  case GST_EVENT_SEGMENT:
    reach (segments_.own, event);
    break;
  case GST_EVENT_FLUSH_STOP:
    reader_.clear ();
    later_.clear ();
    segments_.own = {};
    break;
  case GST_EVENT_EOS:
    add ({segments_.own.count, std::nullopt});
    break;
  default:
    break;
  }
}

void
TrackSink::add (Item item)
{
  if (item.segment > segments_.frames.count) {
    if (later_.size () == TrackReader::kMaxLines)
      later_.pop_front ();
    later_.push_back (std::move (item));
    return;
  }
  if (!item.text) {
    reader_.end ();
    return;
  }
  const auto added = reader_.add (*item.text, item.pts, item.duration);
  if (added)
    return;
  GST_WARNING_OBJECT (pad_, "%s", added.error ().message.c_str ());
  ++damaged_;
}

/* When both have reached a segment, nothing before it counts. */
void
TrackSink::reach (SegmentCount &which, GstEvent *segment)
{
  const guint64 before = segments_.reached ();
  which.follow (segment);
  if (segments_.reached () > before)
    reader_.clear ();
}

/* -------------------------------------------------- thread of the frames -- */

void
TrackSink::restart ()
{
  damaged_ = 0;
  const std::lock_guard lock (lock_);
  reader_ = {};
  segments_ = {};
  later_.clear ();
}

void
TrackSink::next_segment (GstEvent *segment, TrackReader::Order order)
{
  const std::lock_guard lock (lock_);
  reach (segments_.frames, segment);
  reader_.next_segment (order);
  const guint64 current = segments_.frames.count;
  while (!later_.empty () && later_.front ().segment <= current) {
    Item item = std::move (later_.front ());
    later_.pop_front ();
    if (item.segment == current)
      add (std::move (item));
  }
}

void
TrackSink::forget ()
{
  locked (lock_, [&] { return segments_.frames = {}; });
}

} // namespace codedexposure::gst

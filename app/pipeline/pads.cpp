/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "pads.h"

#include <utility>

#include "common/tag.h"

namespace codedexposure::app
{

using namespace gst;

gulong
add_probe (GstPad *pad, int what, Probe probe)
{
  return gst_pad_add_probe (
      pad, GstPadProbeType (what),
      [] (GstPad *at, GstPadProbeInfo *info, gpointer call) noexcept {
        return (*static_cast<Probe *> (call)) (at, info);
      },
      new Probe (std::move (probe)),
      [] (gpointer call) { delete static_cast<Probe *> (call); });
}

void
watch_buffers (GstPad *pad, std::function<void (GstPad *, GstBuffer *)> take)
{
  add_probe (pad, GST_PAD_PROBE_TYPE_BUFFER,
      [take = std::move (take)] (GstPad *at, GstPadProbeInfo *info) {
        take (at, GST_PAD_PROBE_INFO_BUFFER (info));
        return GST_PAD_PROBE_OK;
      });
}

ObjectPtr<GstElement>
element_behind (GstPad *pad)
{
  const ObjectPtr<GstPad> peer (gst_pad_get_peer (pad));
  return ObjectPtr<GstElement> (
      peer ? gst_pad_get_parent_element (peer.get ()) : nullptr);
}

std::optional<GstSegment>
segment_at (GstPad *pad)
{
  const EventPtr event (gst_pad_get_sticky_event (pad, GST_EVENT_SEGMENT, 0));
  return event ? std::optional (*segment_of (event.get ())) : std::nullopt;
}

GstClockTime
stream_time (GstPad *pad, GstClockTime time)
{
  const auto segment = segment_at (pad);
  guint64 position = 0;
  return segment && gst_segment_to_stream_time_full (
                        &*segment, GST_FORMAT_TIME, time, &position) > 0
             ? position
             : time;
}

std::optional<GstVideoInfo>
video_at (GstPad *pad)
{
  const CapsPtr caps (gst_pad_get_current_caps (pad));
  GstVideoInfo info;
  return caps && gst_video_info_from_caps (&info, caps.get ())
             ? std::optional (info)
             : std::nullopt;
}

std::vector<EventPtr>
tags_at (GstPad *pad)
{
  std::vector<EventPtr> all;
  while (GstEvent *event =
             gst_pad_get_sticky_event (pad, GST_EVENT_TAG, all.size ()))
    all.emplace_back (event);
  return all;
}

std::optional<Provenance>
provenance_in (const std::vector<EventPtr> &tags)
{
  std::optional<Provenance> found;
  for (const EventPtr &event : tags)
    if (const auto here = provenance_from_tags (tags_of (event.get ()));
        here && *here)
      found = **here;
  return found;
}

} // namespace codedexposure::app

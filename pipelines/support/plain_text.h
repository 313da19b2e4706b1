/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <gst/gst.h>

#include "common/raii.h"
#include "record/track.h"

/** Makes the texts at the source pad of @p element plain, which a demuxer has
 * escaped as Pango markup, so that a muxer can write them as they were: with
 * the times that they had, where the segment of a demuxer begins with its first
 * frame. */
inline void
make_texts_plain (GstElement *element)
{
  const auto on_text = [] (GstPad *, GstPadProbeInfo *info, gpointer) {
    auto *buffer = GST_PAD_PROBE_INFO_BUFFER (info);
    GstMapInfo map;
    if (!gst_buffer_map (buffer, &map, GST_MAP_READ))
      return GST_PAD_PROBE_OK;
    const std::string text = codedexposure::unescape_markup (
        {reinterpret_cast<const char *> (map.data), map.size});
    gst_buffer_unmap (buffer, &map);
    GstBuffer *plain = gst_buffer_new_memdup (text.data (), text.size ());
    gst_buffer_copy_into (plain, buffer,
        GstBufferCopyFlags (GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS),
        0, -1);
    gst_buffer_unref (buffer);
    info->data = plain;
    return GST_PAD_PROBE_OK;
  };
  const codedexposure::gst::ObjectPtr<GstPad> pad (
      gst_element_get_static_pad (element, "src"));
  gst_pad_add_probe (
      pad.get (), GST_PAD_PROBE_TYPE_BUFFER, on_text, nullptr, nullptr);
}

/** The streams of @p demuxer get the times of its file as running times. Its
 * segment begins with the first frame, which would become time 0. */
inline void
keep_times_of_file (GstElement *demuxer)
{
  const auto on_event = [] (GstPad *, GstPadProbeInfo *info, gpointer) {
    GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
    if (GST_EVENT_TYPE (event) != GST_EVENT_SEGMENT)
      return GST_PAD_PROBE_OK;
    const GstSegment *said = nullptr;
    gst_event_parse_segment (event, &said);
    GstSegment segment = *said;
    segment.start = segment.time = segment.base = segment.position = 0;
    GstEvent *replaced = gst_event_new_segment (&segment);
    gst_event_set_seqnum (replaced, gst_event_get_seqnum (event));
    gst_event_unref (event);
    info->data = replaced;
    return GST_PAD_PROBE_OK;
  };
  const auto on_pad = [] (GstElement *, GstPad *pad, gpointer probe) {
    gst_pad_add_probe (pad, GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
        reinterpret_cast<GstPadProbeCallback> (probe), nullptr, nullptr);
  };
  const GstPadProbeCallback probe = on_event;
  g_signal_connect (demuxer, "pad-added",
      G_CALLBACK (
          +static_cast<void (*) (GstElement *, GstPad *, gpointer)> (on_pad)),
      reinterpret_cast<gpointer> (probe));
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "muxer_input.h"

#include <algorithm>
#include <utility>

#include "common/element.h"
#include "common/meta.h"
#include "common/raii.h"
#include "container.h"
#include "parts.h"

namespace codedexposure::gst
{

namespace
{

bool
has_format (const GstCaps *caps, const char *format)
{
  const GstStructure *structure = gst_caps_get_structure (caps, 0);
  const gchar *own = gst_structure_get_string (structure, "format");
  return gst_structure_has_name (structure, "video/x-raw") &&
         g_strcmp0 (own, format) == 0;
}

/* It would refuse 16-bit grey. */
GstPadProbeReturn
answer (GstQuery *query)
{
  GstCaps *caps = nullptr;
  if (GST_QUERY_TYPE (query) == GST_QUERY_ACCEPT_CAPS) {
    gst_query_parse_accept_caps (query, &caps);
    if (!has_format (caps, "GRAY16_LE") && !has_format (caps, kDeepFormat))
      return GST_PAD_PROBE_OK;
    gst_query_set_accept_caps_result (query, TRUE);
    return GST_PAD_PROBE_HANDLED;
  }
  if (GST_QUERY_TYPE (query) != GST_QUERY_CAPS)
    return GST_PAD_PROBE_OK;
  answer_caps (query, CapsPtr (gst_caps_from_string (kPartCaps)));
  return GST_PAD_PROBE_HANDLED;
}

GstEvent *
rename_format (GstEvent *event)
{
  GstCaps *caps = caps_of (event);
  if (!has_format (caps, "GRAY16_LE"))
    return event;
  const CapsPtr renamed (gst_caps_copy (caps));
  gst_caps_set_simple (
      renamed.get (), "format", G_TYPE_STRING, kDeepFormat, nullptr);
  gst_event_unref (event);
  return gst_event_new_caps (renamed.get ());
}

/* Frames of another recording were taken when that was made. */
void
keep_date (GstElement *mux, const GstTagList *tags)
{
  GstDateTime *date = nullptr;
  if (!gst_tag_list_get_date_time (tags, GST_TAG_DATE_TIME, &date))
    return;
  if (GDateTime *taken = gst_date_time_to_g_date_time (date)) {
    g_object_set (mux, "creation-time", taken, nullptr);
    g_date_time_unref (taken);
  }
  gst_date_time_unref (date);
}

void
note_caps (MuxerInput &input, GstCaps *caps)
{
  input.raw = {};
  if (!is_encoded (caps))
    gst_video_info_from_caps (&input.raw, caps);
}

GstPadProbeReturn
on_video (GstPad *pad, GstPadProbeInfo *info, gpointer input) noexcept
{
  const auto type = GST_PAD_PROBE_INFO_TYPE (info);
  if (type & GST_PAD_PROBE_TYPE_QUERY_DOWNSTREAM)
    return type & GST_PAD_PROBE_TYPE_PUSH
               ? answer (GST_PAD_PROBE_INFO_QUERY (info))
               : GST_PAD_PROBE_OK;
  auto *event = GST_PAD_PROBE_INFO_EVENT (info);
  if (GST_EVENT_TYPE (event) == GST_EVENT_CAPS) {
    note_caps (*static_cast<MuxerInput *> (input), caps_of (event));
    info->data = rename_format (event);
  }
  if (GST_EVENT_TYPE (event) == GST_EVENT_TAG)
    keep_date (GST_PAD_PARENT (pad), tags_of (event));
  return GST_PAD_PROBE_OK;
}

bool
is_packed (const GstVideoInfo &info, GstBuffer *frame)
{
  const auto layout = layout_of (info, frame);
  return layout && layout->offset == info.offset[0] &&
         layout->stride == info.stride[0] &&
         gst_buffer_get_size (frame) == GST_VIDEO_INFO_SIZE (&info);
}

/* Null: its pixels cannot be read. */
BufferPtr
packed (const GstVideoInfo &info, GstBuffer *frame)
{
  BufferPtr copy (
      gst_buffer_new_allocate (nullptr, GST_VIDEO_INFO_SIZE (&info), nullptr));
  gst_buffer_memset (copy.get (), 0, 0, GST_VIDEO_INFO_SIZE (&info));
  MappedFrame source (info, frame, GST_MAP_READ);
  MappedFrame target (info, copy.get (), GST_MAP_WRITE);
  if (!source || !target ||
      !gst_video_frame_copy (target.frame (), source.frame ()))
    return nullptr;
  copy_description (frame, info, copy.get ());
  return copy;
}

/* The muxer stores all bytes of a buffer, also those that are no pixels. */
GstPadProbeReturn
on_frame (GstPad *pad, GstPadProbeInfo *info, gpointer input) noexcept
{
  const GstVideoInfo &raw = static_cast<MuxerInput *> (input)->raw;
  const BufferPtr frame (GST_PAD_PROBE_INFO_BUFFER (info));
  if (!raw.finfo || is_packed (raw, frame.get ())) {
    info->data = gst_buffer_ref (frame.get ());
    return GST_PAD_PROBE_OK;
  }
  info->data = packed (raw, frame.get ()).release ();
  if (info->data)
    return GST_PAD_PROBE_OK;
  POST_ERROR (GST_PAD_PARENT (pad), RESOURCE, READ,
      unreadable_text (raw, frame.get ()));
  GST_PAD_PROBE_INFO_FLOW_RETURN (info) = GST_FLOW_ERROR;
  return GST_PAD_PROBE_HANDLED;
}

/* With live sources, matroskamux >= 1.24 does not wait for frames: it writes
 * the lines of frames that come late, because their encoder is slow, seconds
 * before them, and the frames get wrong times. */
GstPadProbeReturn
on_latency (GstPad *, GstPadProbeInfo *info, gpointer) noexcept
{
  GstQuery *query = GST_PAD_PROBE_INFO_QUERY (info);
  if (GST_QUERY_TYPE (query) != GST_QUERY_LATENCY)
    return GST_PAD_PROBE_OK;
  gst_query_set_latency (query, FALSE, 0, GST_CLOCK_TIME_NONE);
  return GST_PAD_PROBE_HANDLED;
}

/* The muxer takes frames and lines in the order of their DTS, which is that in
 * which they come, so that a frame that is late is written with its line.
 * @last: a GstClockTime. */
GstPadProbeReturn
on_buffer (GstPad *, GstPadProbeInfo *info, gpointer last) noexcept
{
  auto &order = *static_cast<GstClockTime *> (last);
  GstBuffer *buffer =
      gst_buffer_make_writable (GST_PAD_PROBE_INFO_BUFFER (info));
  info->data = buffer;
  if (!GST_BUFFER_PTS_IS_VALID (buffer))
    return GST_PAD_PROBE_OK;
  if (GST_CLOCK_TIME_IS_VALID (order))
    order = std::max (order + 1, GST_BUFFER_PTS (buffer));
  else
    order = GST_BUFFER_PTS (buffer);
  GST_BUFFER_DTS (buffer) = order;
  return GST_PAD_PROBE_OK;
}

} // namespace

void
MuxerInput::request_from (GstElement *mux)
{
  const ObjectPtr<GstPad> own_video (
      gst_element_request_pad_simple (mux, "video_%u"));
  const ObjectPtr<GstPad> own_text (
      gst_element_request_pad_simple (mux, "subtitle_%u"));
  video = own_video.get ();
  text = own_text.get ();
  gst_pad_add_probe (video,
      GstPadProbeType (GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM |
                       GST_PAD_PROBE_TYPE_QUERY_DOWNSTREAM),
      on_video, this, nullptr);
  gst_pad_add_probe (video, GST_PAD_PROBE_TYPE_BUFFER, on_frame, this, nullptr);
  for (const auto &[pad, order] :
      {std::pair{video, &frame_order}, std::pair{text, &line_order}}) {
    gst_pad_add_probe (
        pad, GST_PAD_PROBE_TYPE_QUERY_UPSTREAM, on_latency, nullptr, nullptr);
    gst_pad_add_probe (
        pad, GST_PAD_PROBE_TYPE_BUFFER, on_buffer, order, nullptr);
  }
}

} // namespace codedexposure::gst

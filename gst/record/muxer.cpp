/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "muxer.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "common/element.h"
#include "common/meta.h"
#include "common/raii.h"
#include "parts.h"
#include "record/ebml.h"
#include "record/matroska.h"

namespace codedexposure::gst
{

/* ---------------------------------------------------------------- input -- */

namespace
{

/* The format that matroskamux gets for raw frames with 16-bit pixels, which it
 * does not know: any four letters are a FourCC. FFmpeg knows these frames by
 * another, which is no text, and which the file has. */
constexpr char kDeepFormat[] = "Y16 ";

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
    GstVideoInfo &raw = static_cast<MuxerInput *> (input)->raw;
    raw = {};
    if (!is_encoded (caps_of (event)))
      gst_video_info_from_caps (&raw, caps_of (event));
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

/* --------------------------------------------------------------- output -- */

namespace
{

using namespace std::string_view_literals;

/* Names of elements of Matroska (RFC 9559). */
constexpr auto kTags = "\x12\x54\xc3\x67"sv, kTagString = "\x44\x87"sv;

/* The name "Subtitle" is as long as a shorter one with FlagDefault 0. */
constexpr std::pair<std::string_view, std::string_view> kRewritten[] = {
    {"\x2e\xb5\x24\x84Y16 "sv, "\x2e\xb5\x24\x84Y1\0\x10"sv},
    {"\x53\x6e\x89Subtitle\0"sv, "\x88\x81\0\x53\x6e\x86"
                                 "Frames"sv}};

std::string
bytes_of (GstBuffer *buffer, gsize most)
{
  std::string bytes (std::min (most, gst_buffer_get_size (buffer)), '\0');
  gst_buffer_extract (buffer, 0, bytes.data (), bytes.size ());
  return bytes;
}

/* Texts that are quoted become plain, which is shorter; a zero ends them. */
void
make_texts_plain (std::string &bytes)
{
  for (auto at = bytes.find (kTagString); at != bytes.npos;
       at = bytes.find (kTagString, at + kTagString.size ())) {
    const auto text =
        ebml::Source::of (bytes).element_at (at, ebml::kUnlimited);
    if (!text)
      continue;
    const auto quoted =
        std::string_view (bytes).substr (text->data, text->end - text->data);
    const auto end = quoted.find_last_not_of ('\0');
    auto plain = unquoted_tag (quoted.substr (0, end + 1));
    if (!plain)
      continue;
    plain->resize (quoted.size (), '\0');
    bytes.replace (text->data, plain->size (), *plain);
  }
}

/* Transfer: full, of both. */
GstBuffer *
with_bytes (GstBuffer *buffer, const std::string &bytes)
{
  GstBuffer *rewritten = gst_buffer_new_memdup (bytes.data (), bytes.size ());
  gst_buffer_copy_into (rewritten, buffer, GST_BUFFER_COPY_METADATA, 0, -1);
  gst_buffer_unref (buffer);
  return rewritten;
}

GstBuffer *
with_head_for_all (GstBuffer *buffer)
{
  constexpr gsize kLongestHead = 8 << 20;
  if (gst_buffer_get_size (buffer) > kLongestHead)
    return buffer;
  std::string head = bytes_of (buffer, kLongestHead);
  for (const auto &[own, for_all] : kRewritten)
    for (auto at = head.find (own); at != head.npos; at = head.find (own, at))
      head.replace (at, own.size (), for_all);
  make_texts_plain (head);
  return with_bytes (buffer, head);
}

GstEvent *
with_heads_for_all (GstEvent *event)
{
  GstCaps *caps = caps_of (event);
  const GValue *heads = gst_structure_get_value (
      gst_caps_get_structure (caps, 0), "streamheader");
  if (!heads)
    return event;
  GValue rewritten = G_VALUE_INIT;
  g_value_init (&rewritten, GST_TYPE_ARRAY);
  for (guint i = 0; i < gst_value_array_get_size (heads); i++) {
    const GValue *head = gst_value_array_get_value (heads, i);
    GValue one = G_VALUE_INIT;
    g_value_init (&one, GST_TYPE_BUFFER);
    gst_value_take_buffer (
        &one, with_head_for_all (gst_buffer_ref (gst_value_get_buffer (head))));
    gst_value_array_append_and_take_value (&rewritten, &one);
  }
  const CapsPtr copy (gst_caps_copy (caps));
  gst_structure_take_value (
      gst_caps_get_structure (copy.get (), 0), "streamheader", &rewritten);
  gst_event_unref (event);
  return gst_event_new_caps (copy.get ());
}

} // namespace

/* Frames come as buffers of their own and may contain anything. */
void
MuxerOutput::rewrite (GstPadProbeInfo *info)
{
  constexpr gsize kMasterSize = 12; // of an element that holds others
  if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM) {
    GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
    if (GST_EVENT_TYPE (event) == GST_EVENT_CAPS)
      info->data = with_heads_for_all (event);
    return;
  }
  GstBuffer *buffer = GST_PAD_PROBE_INFO_BUFFER (info);
  const std::string begin = bytes_of (buffer, kTags.size ());
  has_frames_ |= begin == ebml::kClusterName;
  has_tags_ |= has_frames_ && begin == kTags &&
               gst_buffer_get_size (buffer) == kMasterSize;
  if (!has_frames_) {
    info->data = with_head_for_all (buffer);
  } else if (has_tags_) {
    std::string bytes = bytes_of (buffer, gsize (-1));
    make_texts_plain (bytes);
    info->data = with_bytes (buffer, bytes);
  }
}

} // namespace codedexposure::gst

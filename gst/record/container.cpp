/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "container.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "common/raii.h"
#include "record/ebml.h"
#include "record/matroska.h"

namespace codedexposure::gst
{

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
with_plain_texts (GstBuffer *buffer)
{
  std::string bytes = bytes_of (buffer, gsize (-1));
  make_texts_plain (bytes);
  return with_bytes (buffer, bytes);
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
ContainerOutput::rewrite (GstPadProbeInfo *info)
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
  if (!has_frames_)
    info->data = with_head_for_all (buffer);
  else if (has_tags_)
    info->data = with_plain_texts (buffer);
}

} // namespace codedexposure::gst

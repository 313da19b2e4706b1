/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "large_frames.h"

#include <string>

namespace codedexposure::gst
{

namespace
{

/* Null: they are not there. */
BufferPtr
read_at (GstPad *source, guint64 at, gsize size)
{
  GstBuffer *bytes = nullptr;
  if (gst_pad_get_range (source, at, guint (size), &bytes) != GST_FLOW_OK)
    return nullptr;
  return BufferPtr (bytes);
}

std::string
text_of (GstBuffer *bytes, gsize from, gsize size)
{
  std::string text (size, '\0');
  text.resize (gst_buffer_extract (bytes, from, text.data (), size));
  return text;
}

} // namespace

GstBuffer *
LargeFrames::pulled (GstPad *sink, guint64 at, GstBuffer *bytes)
{
  const ObjectPtr<GstPad> source (gst_pad_get_peer (sink));
  const guint64 end = at + gst_buffer_get_size (bytes);
  const auto fetch = [&] (guint64 from, gsize size) {
    if (from >= at && from < end)
      return text_of (bytes, from - at, size);
    const BufferPtr more = read_at (source.get (), from, size);
    return more ? text_of (more.get (), 0, size) : std::string ();
  };
  ebml::Source file (fetch, ebml::kUnlimited);
  const auto patches = blocks_.patches (file, at, end);
  if (patches.empty ())
    return bytes;
  bytes = gst_buffer_make_writable (bytes);
  for (const auto &[place, patch] : patches)
    gst_buffer_fill (bytes, place - at, patch.data (), patch.size ());
  return bytes;
}

GstBuffer *
LargeFrames::pushed (GstBuffer *bytes)
{
  GstMapInfo map;
  if (!gst_buffer_map (bytes, &map, GST_MAP_READ))
    return bytes;
  const std::string_view text (
      reinterpret_cast<const char *> (map.data), map.size);
  const bool passes = blocks_.passes (text);
  const std::string passed = passes ? "" : blocks_.take (text);
  gst_buffer_unmap (bytes, &map);
  if (passes)
    return bytes;
  gst_buffer_unref (bytes);
  return passed.empty ()
             ? nullptr
             : gst_buffer_new_memdup (passed.data (), passed.size ());
}

void
LargeFrames::follow (const GstSegment &segment)
{
  if (segment.format == GST_FORMAT_BYTES)
    blocks_.restart (segment.start);
}

GstBuffer *
LargeFrames::put_back (GstPad *sink, GstBuffer *shown) const
{
  constexpr gsize kLongest = 64;
  const auto frame = LargeBlocks::frame_of (text_of (shown, 0, kLongest));
  if (!frame)
    return shown;
  const BufferPtr token (shown);
  BufferPtr own;
  if (const auto kept = blocks_.bytes_of (*frame); !kept.empty ()) {
    own.reset (gst_buffer_new_memdup (kept.data (), kept.size ()));
  } else if (blocks_.hides (*frame)) {
    const ObjectPtr<GstPad> source (gst_pad_get_peer (sink));
    own = read_at (source.get (), frame->at, frame->end - frame->at);
  }
  if (!own || gst_buffer_get_size (own.get ()) < frame->end - frame->at)
    return nullptr;
  own.reset (gst_buffer_make_writable (own.release ()));
  gst_buffer_copy_into (own.get (), shown, GST_BUFFER_COPY_METADATA, 0, -1);
  return own.release ();
}

} // namespace codedexposure::gst

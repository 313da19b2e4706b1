/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "raii.h"

#include <cstdlib>

namespace codedexposure::gst
{

namespace
{

std::string
size_text (const GstVideoInfo &info)
{
  return std::to_string (info.width) + "x" + std::to_string (info.height) +
         " " + GST_VIDEO_INFO_NAME (&info) + " pixels";
}

Error
misfit (
    const GstVideoInfo &info, GstBuffer *buffer, const std::string &requirement)
{
  return {"A buffer of " + std::to_string (gst_buffer_get_size (buffer)) +
          " bytes cannot hold the " + size_text (info) +
          " of its caps: " + requirement +
          ". Correct the caps, or the element that made the buffer."};
}

} // namespace

GstTagList *
tags_of (GstEvent *event)
{
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event, &tags);
  return tags;
}

GstCaps *
caps_of (GstEvent *event)
{
  GstCaps *caps = nullptr;
  gst_event_parse_caps (event, &caps);
  return caps;
}

const GstSegment *
segment_of (GstEvent *event)
{
  const GstSegment *segment = nullptr;
  gst_event_parse_segment (event, &segment);
  return segment;
}

Result<PixelLayout>
layout_of (const GstVideoInfo &info, GstBuffer *buffer)
{
  const gsize size = gst_buffer_get_size (buffer);
  const GstVideoMeta *meta = gst_buffer_get_video_meta (buffer);
  if (!meta) {
    const gsize needed = GST_VIDEO_INFO_SIZE (&info);
    if (size < needed)
      return misfit (
          info, buffer, "they take " + std::to_string (needed) + " bytes");
    return PixelLayout{info.offset[0], info.stride[0]};
  }

  if (meta->format != GST_VIDEO_INFO_FORMAT (&info) ||
      meta->width < guint (info.width) || meta->height < guint (info.height))
    return misfit (info, buffer,
        std::string ("its video meta describes ") +
            std::to_string (meta->width) + "x" + std::to_string (meta->height) +
            " " + gst_video_format_to_string (meta->format) + " pixels");
  /* A negative stride leads from the last row of the memory to the first. */
  const gint64 row =
      gint64 (info.width) * GST_VIDEO_INFO_COMP_PSTRIDE (&info, 0);
  const gint64 stride = meta->stride[0];
  const gint64 last = gint64 (info.height - 1) * stride;
  const gsize offset = meta->offset[0];
  const gsize before = last < 0 ? gsize (-last) : 0;
  const gsize after = gsize (row + std::max<gint64> (last, 0));
  if (std::abs (stride) < row || offset < before || offset > size ||
      after > size - offset)
    return misfit (info, buffer,
        "by its video meta they begin at byte " + std::to_string (offset) +
            ", in rows that are " + std::to_string (stride) + " bytes apart");
  return PixelLayout{offset, meta->stride[0]};
}

std::string
unreadable_text (const GstVideoInfo &info, GstBuffer *buffer)
{
  const auto layout = layout_of (info, buffer);
  return layout ? "The memory of a buffer with " + size_text (info) +
                      " cannot be mapped."
                : layout.error ().message;
}

/* Maps the whole buffer: gst_video_frame_map () maps only the first memory of a
 * buffer with a video meta, and checks no size. */
void
MappedFrame::map (
    const GstVideoInfo &info, GstBuffer *buffer, GstMapFlags flags)
{
  const auto layout = layout_of (info, buffer);
  mapped_ = layout && gst_buffer_map (buffer, &frame_.map[0], flags);
  if (!mapped_)
    return;
  frame_.info = info;
  frame_.info.offset[0] = layout->offset;
  frame_.info.stride[0] = layout->stride;
  frame_.buffer = buffer;
  frame_.data[0] = frame_.map[0].data + layout->offset;
}

} // namespace codedexposure::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames that are kept for later. */
#pragma once

#include <algorithm>

#include "meta.h"
#include "partner.h"
#include "raii.h"

namespace codedexposure::gst
{

/** A reference to @p frame, or a copy if it is of a pool that has no more than
 * some buffers, on which its source would wait. */
inline BufferPtr
kept_frame (GstBuffer *frame)
{
  guint most = 0;
  if (frame->pool) {
    GstStructure *config = gst_buffer_pool_get_config (frame->pool);
    gst_buffer_pool_config_get_params (
        config, nullptr, nullptr, nullptr, &most);
    gst_structure_free (config);
  }
  return BufferPtr (
      most > 0 ? gst_buffer_copy_deep (frame) : gst_buffer_ref (frame));
}

/** Bytes of @p frame, and of its partner. */
inline guint64
bytes_of (GstBuffer *frame)
{
  const auto partner = get_partner (frame);
  return gst_buffer_get_size (frame) +
         (partner ? gst_buffer_get_size (partner->buffer.get ()) : 0);
}

/** Significant bits of the pixels of @p frame: @p set unless that is 0, else
 * what its metadata say, else all of @p info. */
inline int
bits_of (GstBuffer *frame, const GstVideoInfo &info, int set)
{
  const auto meta = get_frame_meta (frame);
  const int depth = int (GST_VIDEO_INFO_COMP_DEPTH (&info, 0));
  const int bits = set > 0 ? set : meta ? meta->bits : 0;
  return bits > 0 ? std::min (bits, depth) : depth;
}

} // namespace codedexposure::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames that are kept for later. */
#pragma once

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

} // namespace codedexposure::gst

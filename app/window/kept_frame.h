/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames that are kept for later. */
#pragma once

#include "common/raii.h"

namespace codedexposure::app
{

/** A reference to @p frame, or a copy if it is of a pool that has no more than
 * some buffers, on which its source would wait. */
inline gst::BufferPtr
kept_frame (GstBuffer *frame)
{
  guint most = 0;
  if (frame->pool) {
    GstStructure *config = gst_buffer_pool_get_config (frame->pool);
    gst_buffer_pool_config_get_params (
        config, nullptr, nullptr, nullptr, &most);
    gst_structure_free (config);
  }
  return gst::BufferPtr (
      most > 0 ? gst_buffer_copy_deep (frame) : gst_buffer_ref (frame));
}

} // namespace codedexposure::app

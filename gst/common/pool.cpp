/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "pool.h"

#include <gst/video/gstvideopool.h>

#include "element.h"
#include "extract/planes.h"
#include "meta.h"

namespace codedexposure::gst
{

namespace
{

struct Count {
  gint made = 0;
};
struct GstCodedPicturePool : Instance<GstVideoBufferPool, Count> {
};

GstMemory *
allocate_staggered (GstBufferPool *pool, int k)
{
  GstStructure *config = gst_buffer_pool_get_config (pool);
  GstAllocator *allocator = nullptr;
  GstAllocationParams params;
  guint size = 0;
  gst_buffer_pool_config_get_allocator (config, &allocator, &params);
  gst_buffer_pool_config_get_params (config, nullptr, &size, nullptr, nullptr);
  params.align |= kRowAlignment - 1;
  params.prefix += plane_stagger (k);
  GstMemory *memory = gst_allocator_alloc (allocator, size, &params);
  gst_structure_free (config);
  return memory;
}

GstFlowReturn
alloc_buffer (GstBufferPool *pool, GstBuffer **buffer,
    GstBufferPoolAcquireParams *params) noexcept
{
  const GstFlowReturn flow =
      parent_class<GstBufferPoolClass> (pool)->alloc_buffer (
          pool, buffer, params);
  if (flow != GST_FLOW_OK)
    return flow;
  const int k =
      g_atomic_int_add (&state_in<GstCodedPicturePool> (pool).made, 1) &
      G_MAXINT;
  if (GstMemory *memory = allocate_staggered (pool, k))
    gst_buffer_replace_all_memory (*buffer, memory);
  set_frame_meta (*buffer, FrameMeta ());
  return GST_FLOW_OK;
}

void
set_up (gpointer klass)
{
  GST_BUFFER_POOL_CLASS (klass)->alloc_buffer = alloc_buffer;
}

} // namespace

GstBufferPool *
make_picture_pool ()
{
  auto *pool = static_cast<GstBufferPool *> (
      g_object_new (type_of<GstCodedPicturePool, set_up> (
                        "GstCodedPicturePool", GST_TYPE_VIDEO_BUFFER_POOL),
          nullptr));
  gst_object_ref_sink (pool);
  return pool;
}

} // namespace codedexposure::gst

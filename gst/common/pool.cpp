/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "pool.h"

#include <gst/video/gstvideopool.h>

#include "extract/planes.h"
#include "meta.h"

using codedexposure::gst::FrameMeta;

struct GstCodedPicturePool {
  GstVideoBufferPool parent;
  gint made;
};
struct GstCodedPicturePoolClass {
  GstVideoBufferPoolClass parent;
};

static GType gst_coded_picture_pool_get_type ();
G_DEFINE_TYPE (
    GstCodedPicturePool, gst_coded_picture_pool, GST_TYPE_VIDEO_BUFFER_POOL)

static GstMemory *
allocate_staggered (GstBufferPool *pool, int k)
{
  GstStructure *config = gst_buffer_pool_get_config (pool);
  GstAllocator *allocator = nullptr;
  GstAllocationParams params;
  guint size = 0;
  gst_buffer_pool_config_get_allocator (config, &allocator, &params);
  gst_buffer_pool_config_get_params (config, nullptr, &size, nullptr, nullptr);
  params.align |= codedexposure::kRowAlignment - 1;
  params.prefix += codedexposure::plane_stagger (k);
  GstMemory *memory = gst_allocator_alloc (allocator, size, &params);
  gst_structure_free (config);
  return memory;
}

static GstFlowReturn
gst_coded_picture_pool_alloc_buffer (
    GstBufferPool *pool, GstBuffer **buffer, GstBufferPoolAcquireParams *params)
{
  const GstFlowReturn flow =
      GST_BUFFER_POOL_CLASS (gst_coded_picture_pool_parent_class)
          ->alloc_buffer (pool, buffer, params);
  if (flow != GST_FLOW_OK)
    return flow;
  auto *self = reinterpret_cast<GstCodedPicturePool *> (pool);
  const int k = g_atomic_int_add (&self->made, 1) & G_MAXINT;
  if (GstMemory *memory = allocate_staggered (pool, k))
    gst_buffer_replace_all_memory (*buffer, memory);
  codedexposure::gst::set_frame_meta (*buffer, FrameMeta ());
  return GST_FLOW_OK;
}

static void
gst_coded_picture_pool_class_init (GstCodedPicturePoolClass *klass)
{
  GST_BUFFER_POOL_CLASS (klass)->alloc_buffer =
      gst_coded_picture_pool_alloc_buffer;
}

static void
gst_coded_picture_pool_init (GstCodedPicturePool *)
{
}

namespace codedexposure::gst
{

GstBufferPool *
make_picture_pool ()
{
  auto *pool = static_cast<GstBufferPool *> (
      g_object_new (gst_coded_picture_pool_get_type (), nullptr));
  gst_object_ref_sink (pool);
  return pool;
}

} // namespace codedexposure::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "gstsubframepool.h"

#include <gst/video/gstvideopool.h>

#include "extract/planes.h"
#include "gstcodedexposuremeta.h"

using cexp::gst::FrameMeta;

struct GstSubframePool {
  GstVideoBufferPool parent;
  gint made;
};
struct GstSubframePoolClass {
  GstVideoBufferPoolClass parent;
};

static GType gst_subframe_pool_get_type ();
G_DEFINE_TYPE (GstSubframePool, gst_subframe_pool, GST_TYPE_VIDEO_BUFFER_POOL)

static GstMemory *
allocate_staggered (GstBufferPool *pool, int k)
{
  GstStructure *config = gst_buffer_pool_get_config (pool);
  GstAllocator *allocator = nullptr;
  GstAllocationParams params;
  guint size = 0;
  gst_buffer_pool_config_get_allocator (config, &allocator, &params);
  gst_buffer_pool_config_get_params (config, nullptr, &size, nullptr, nullptr);
  params.align |= cexp::kRowAlignment - 1;
  params.prefix += cexp::plane_stagger (k);
  GstMemory *memory = gst_allocator_alloc (allocator, size, &params);
  gst_structure_free (config);
  return memory;
}

static GstFlowReturn
gst_subframe_pool_alloc_buffer (
    GstBufferPool *pool, GstBuffer **buffer, GstBufferPoolAcquireParams *params)
{
  const GstFlowReturn flow =
      GST_BUFFER_POOL_CLASS (gst_subframe_pool_parent_class)
          ->alloc_buffer (pool, buffer, params);
  if (flow != GST_FLOW_OK)
    return flow;
  auto *self = reinterpret_cast<GstSubframePool *> (pool);
  const int k = g_atomic_int_add (&self->made, 1) & G_MAXINT;
  if (GstMemory *memory = allocate_staggered (pool, k))
    gst_buffer_replace_all_memory (*buffer, memory);
  cexp::gst::set_frame_meta (*buffer, FrameMeta ());
  return GST_FLOW_OK;
}

static void
gst_subframe_pool_class_init (GstSubframePoolClass *klass)
{
  GST_BUFFER_POOL_CLASS (klass)->alloc_buffer = gst_subframe_pool_alloc_buffer;
}

static void
gst_subframe_pool_init (GstSubframePool *)
{
}

namespace cexp::gst
{

GstBufferPool *
make_subframe_pool ()
{
  auto *pool = static_cast<GstBufferPool *> (
      g_object_new (gst_subframe_pool_get_type (), nullptr));
  gst_object_ref_sink (pool);
  return pool;
}

} // namespace cexp::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Buffers: downstream's own where it offers a pool, else from a pool of ours.
 */
#include "gstcodedexposuredemuxstate.h"
#include "gstsubframepool.h"

#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace cexp::gst::demux
{

namespace
{

/* What the peer of a pad asks for. */
struct Offer {
  ObjectPtr<GstBufferPool> pool;
  guint size = 0, min = 0, max = 0;
  ObjectPtr<GstAllocator> allocator;
  GstAllocationParams params;
  bool video_meta = false;
};

Offer
ask_downstream (GstPad *pad, GstCaps *caps)
{
  Offer offer;
  gst_allocation_params_init (&offer.params);
  const QueryPtr query (gst_query_new_allocation (caps, TRUE));
  if (!gst_pad_peer_query (pad, query.get ())) {
    GST_DEBUG_OBJECT (pad, "downstream has no wishes about buffers");
    return offer;
  }
  offer.video_meta = gst_query_find_allocation_meta (
      query.get (), GST_VIDEO_META_API_TYPE, nullptr);
  if (gst_query_get_n_allocation_params (query.get ()) > 0) {
    GstAllocator *allocator = nullptr;
    gst_query_parse_nth_allocation_param (
        query.get (), 0, &allocator, &offer.params);
    offer.allocator.reset (allocator);
  }
  if (gst_query_get_n_allocation_pools (query.get ()) > 0) {
    GstBufferPool *pool = nullptr;
    gst_query_parse_nth_allocation_pool (
        query.get (), 0, &pool, &offer.size, &offer.min, &offer.max);
    offer.pool.reset (pool);
  }
  return offer;
}

/* @at_once buffers are out at the same time, beside those that downstream
 * holds. */
bool
configure (GstBufferPool *pool, const Offer &offer, GstCaps *caps, guint size,
    guint at_once)
{
  const guint min = offer.min + at_once;
  GstStructure *config = gst_buffer_pool_get_config (pool);
  gst_buffer_pool_config_set_params (config, caps, size, min, offer.max);
  gst_buffer_pool_config_set_allocator (
      config, offer.allocator.get (), &offer.params);
  if (offer.video_meta &&
      gst_buffer_pool_has_option (pool, GST_BUFFER_POOL_OPTION_VIDEO_META))
    gst_buffer_pool_config_add_option (
        config, GST_BUFFER_POOL_OPTION_VIDEO_META);
  if (gst_buffer_pool_set_config (pool, config))
    return true;

  /* The pool has changed the configuration to what it can do. */
  config = gst_buffer_pool_get_config (pool);
  if (gst_buffer_pool_config_validate_params (
          config, caps, size, min, offer.max))
    return gst_buffer_pool_set_config (pool, config);
  gst_structure_free (config);
  return false;
}

/* All subframes of a frame are written together, so a pool that cannot give
 * them all at once would never give the last one. */
GstBufferPool *
choose_pool (
    GstPad *pad, Offer &offer, GstCaps *caps, gsize frame_size, guint at_once)
{
  const guint size = std::max (guint (frame_size), offer.size);
  if (offer.pool) {
    if (offer.max != 0 && offer.max < offer.min + at_once)
      GST_INFO_OBJECT (
          pad, "downstream's pool holds %u buffers, too few", offer.max);
    else if (configure (offer.pool.get (), offer, caps, size, at_once))
      return offer.pool.release ();
    offer.min = offer.max = 0;
  }
  GstBufferPool *pool = make_subframe_pool ();
  if (configure (pool, offer, caps, size, 0))
    return pool;
  gst_object_unref (pool);
  return nullptr;
}

} // namespace

void
prepare_allocation (GstCodedExposureDemux *self, Output &output, guint at_once)
{
  GstPad *pad = output.pad.get ();
  if (gst_pad_check_reconfigure (pad))
    output.allocation.reset ();
  if (output.allocation)
    return;

  const CapsPtr caps = caps_for (self, output);
  GstVideoInfo info;
  gst_video_info_from_caps (&info, caps.get ());
  Offer offer = ask_downstream (pad, caps.get ());
  Allocation &allocation = output.allocation.emplace ();
  allocation.video_meta = offer.video_meta;
  allocation.pool.reset (choose_pool (
      pad, offer, caps.get (), GST_VIDEO_INFO_SIZE (&info), at_once));
  GST_DEBUG_OBJECT (pad, "pool %" GST_PTR_FORMAT ", video meta %s",
      allocation.pool.get (), allocation.video_meta ? "yes" : "no");
}

GstFlowReturn
acquire (Output &output, BufferPtr &outbuf)
{
  Allocation &allocation = *output.allocation;
  if (!allocation.active && allocation.pool)
    allocation.active =
        gst_buffer_pool_set_active (allocation.pool.get (), TRUE);
  if (!allocation.active)
    return GST_FLOW_ERROR;
  GstBuffer *buffer = nullptr;
  const GstFlowReturn flow =
      gst_buffer_pool_acquire_buffer (allocation.pool.get (), &buffer, nullptr);
  outbuf.reset (buffer);
  return flow;
}

/* The coded pad hands upstream's own memory on, so upstream may only use
 * strides of its own where that pad's peer reads them too. */
gboolean
answer_allocation (GstCodedExposureDemux *self, GstQuery *query)
{
  GstCaps *caps = nullptr;
  gst_query_parse_allocation (query, &caps, nullptr);
  GstVideoInfo info;
  if (!caps || !gst_video_info_from_caps (&info, caps))
    return FALSE;

  bool video_meta = true;
  if (const OutputRef coded = outputs (self)->coded;
      coded && is_wanted (*coded))
    video_meta = ask_downstream (coded->pad.get (), caps).video_meta;
  if (video_meta)
    gst_query_add_allocation_meta (query, GST_VIDEO_META_API_TYPE, nullptr);

  GstBufferPool *pool = gst_video_buffer_pool_new ();
  GstStructure *config = gst_buffer_pool_get_config (pool);
  const guint size = guint (GST_VIDEO_INFO_SIZE (&info));
  gst_buffer_pool_config_set_params (config, caps, size, 0, 0);
  if (gst_buffer_pool_set_config (pool, config))
    gst_query_add_allocation_pool (query, pool, size, 0, 0);
  gst_object_unref (pool);
  return TRUE;
}

} // namespace cexp::gst::demux

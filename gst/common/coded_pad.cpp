/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Source pads take buffers from downstream's pool if it offers one, else from
 * their own. */
#include "coded_pad.h"

#include <algorithm>
#include <string_view>

#include <gst/video/gstvideopool.h>

#include "extract/planes.h"
#include "meta.h"

#define GST_CAT_DEFAULT coded_filter_debug

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
set_up_pool (gpointer klass)
{
  GST_BUFFER_POOL_CLASS (klass)->alloc_buffer = alloc_buffer;
}

/* Its buffers start at different offsets in a memory page, because all
 * subframes of a coded frame are written at once (plane_stagger ()). Each
 * buffer always has the meta CodedExposureFrame; set it after a buffer is
 * acquired. Transfer: full. */
GstBufferPool *
make_picture_pool ()
{
  auto *pool = static_cast<GstBufferPool *> (
      g_object_new (type_of<GstCodedPicturePool, set_up_pool> (
                        "GstCodedPicturePool", GST_TYPE_VIDEO_BUFFER_POOL),
          nullptr));
  gst_object_ref_sink (pool);
  return pool;
}

/* The answer of a pad's peer to an ALLOCATION query. */
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
    GST_DEBUG_OBJECT (pad, "downstream does not answer ALLOCATION");
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

/* @at_once buffers are in use at the same time, in addition to those that
 * downstream holds. */
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

  /* The pool has adapted the configuration to its limits. */
  config = gst_buffer_pool_get_config (pool);
  if (gst_buffer_pool_config_validate_params (
          config, caps, size, min, offer.max))
    return gst_buffer_pool_set_config (pool, config);
  gst_structure_free (config);
  return false;
}

/* All pictures of a coded frame are written together, so a smaller pool would
 * block for ever on the last one. */
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
  GstBufferPool *pool = make_picture_pool ();
  if (configure (pool, offer, caps, size, 0))
    return pool;
  gst_object_unref (pool);
  return nullptr;
}

constexpr struct {
  PadKind kind;
  std::string_view name; ///< of the template
} kTemplates[] = {{PadKind::coded, "coded"}, {PadKind::all, "src"},
    {PadKind::one, "subframe_%u"}, {PadKind::region, "region_%u"},
    {PadKind::uncertainty, "uncertainty"}};

} // namespace

GType
coded_pad_type ()
{
  return type_of<GstCodedPad, [] (gpointer) {}> ("GstCodedPad", GST_TYPE_PAD);
}

GstCodedPad *
find_pad (const PadMap &pads, PadKind kind, int index)
{
  const auto found = pads.find ({kind, index});
  return found == pads.end () ? nullptr : found->second.get ();
}

PadKind
kind_of_template (const std::string &name)
{
  return std::ranges::find (kTemplates, name, [] (const auto &templ) {
    return templ.name;
  })->kind;
}

std::string
prefix_of (PadKind kind)
{
  const std::string_view name =
      std::ranges::find (kTemplates, kind, [] (const auto &templ) {
        return templ.kind;
      })->name;
  return std::string (name.substr (0, name.find ('%')));
}

GstCaps *
PadCaps::of (const CodedPad &pad) const
{
  const auto found =
      find ({pad.kind, pad.kind == PadKind::region ? pad.index : -1});
  return found == end () ? nullptr : found->second.get ();
}

/* gst_pad_create_stream_id () needs the sink pad's sticky event, which is
 * stored only after its handler has returned. */
EventPtr
stream_start_for (GstCodedPad *pad, GstEvent *upstream)
{
  const gchar *id = nullptr;
  gst_event_parse_stream_start (upstream, &id);
  const CharPtr name (gst_object_get_name (GST_OBJECT (pad)));
  const std::string own = std::string (id) + "/" + name.get ();

  EventPtr event (gst_event_new_stream_start (own.c_str ()));
  gst_event_set_seqnum (event.get (), gst_event_get_seqnum (upstream));
  GstStreamFlags flags = GST_STREAM_FLAG_NONE;
  gst_event_parse_stream_flags (upstream, &flags);
  gst_event_set_stream_flags (event.get (), flags);
  guint group = GST_GROUP_ID_INVALID;
  if (gst_event_parse_group_id (upstream, &group))
    gst_event_set_group_id (event.get (), group);
  return event;
}

bool
is_wanted (GstPad *pad)
{
  return gst_pad_is_linked (pad) || gst_pad_is_blocked (pad);
}

bool
peer_reads_video_meta (GstPad *pad, GstCaps *caps)
{
  return ask_downstream (pad, caps).video_meta;
}

void
prepare_allocation (GstCodedPad *coded, GstCaps *caps, guint at_once)
{
  GstPad *pad = GST_PAD (coded);
  std::optional<Allocation> &allocation = coded->state.allocation;
  if (gst_pad_check_reconfigure (pad))
    allocation.reset ();
  if (allocation)
    return;

  GstVideoInfo info;
  gst_video_info_from_caps (&info, caps);
  Offer offer = ask_downstream (pad, caps);
  allocation.emplace ();
  allocation->video_meta = offer.video_meta;
  allocation->pool.reset (
      choose_pool (pad, offer, caps, GST_VIDEO_INFO_SIZE (&info), at_once));
  GST_DEBUG_OBJECT (pad, "pool %" GST_PTR_FORMAT ", video meta %s",
      allocation->pool.get (), allocation->video_meta ? "yes" : "no");
}

GstFlowReturn
acquire (
    GstCodedPad *pad, const GstVideoInfo &info, bool first, BufferPtr &outbuf)
{
  Allocation &allocation = *pad->state.allocation;
  if (!allocation.active && allocation.pool)
    allocation.active =
        gst_buffer_pool_set_active (allocation.pool.get (), TRUE);
  if (!allocation.active)
    return GST_FLOW_ERROR;
  GstBuffer *buffer = nullptr;
  GstBufferPoolAcquireParams params = {};
  params.flags = first ? GST_BUFFER_POOL_ACQUIRE_FLAG_NONE
                       : GST_BUFFER_POOL_ACQUIRE_FLAG_DONTWAIT;
  GstFlowReturn flow =
      gst_buffer_pool_acquire_buffer (allocation.pool.get (), &buffer, &params);
  if (!first && flow == GST_FLOW_EOS) {
    GST_LOG_OBJECT (pad, "the pool is empty");
    buffer =
        gst_buffer_new_allocate (nullptr, GST_VIDEO_INFO_SIZE (&info), nullptr);
    flow = buffer ? GST_FLOW_OK : GST_FLOW_ERROR;
  }
  outbuf.reset (buffer);
  return flow;
}

GstFlowReturn
push_picture (GstCodedPad *pad, BufferPtr outbuf, GstClockTime duration)
{
  CodedPad &coded = pad->state;
  GST_BUFFER_DURATION (outbuf.get ()) = duration;
  GST_BUFFER_OFFSET (outbuf.get ()) = coded.offset++;
  GST_BUFFER_OFFSET_END (outbuf.get ()) = coded.offset;
  /* A DISCONT of the coded frame does not apply to each of its pictures. */
  if (std::exchange (coded.discont, false)) {
    GST_BUFFER_FLAG_SET (outbuf.get (), GST_BUFFER_FLAG_DISCONT);
  } else {
    GST_BUFFER_FLAG_UNSET (outbuf.get (), GST_BUFFER_FLAG_DISCONT);
    GST_BUFFER_FLAG_UNSET (outbuf.get (), GST_BUFFER_FLAG_RESYNC);
  }
  GST_LOG_OBJECT (pad, "[OUT] %" GST_PTR_FORMAT, outbuf.get ());
  return gst_pad_push (GST_PAD (pad), outbuf.release ());
}

void
note_lateness (GstCodedPad *pad, GstEvent *event)
{
  CodedPad &coded = pad->state;
  GstQOSType type;
  GstClockTime time = GST_CLOCK_TIME_NONE;
  gst_event_parse_qos (event, &type, &coded.proportion, &coded.jitter, &time);
  coded.earliest =
      GST_CLOCK_TIME_IS_VALID (time)
          ? GstClockTime (std::max<gint64> (gint64 (time) + coded.jitter, 0))
          : GST_CLOCK_TIME_NONE;
}

void
forget_lateness (GstCodedPad *pad)
{
  pad->state.earliest = GST_CLOCK_TIME_NONE;
  pad->state.proportion = 1.0;
  pad->state.jitter = 0;
}

} // namespace codedexposure::gst

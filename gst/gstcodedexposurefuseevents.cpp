/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Events and queries of codedexposure-fuse. */
#include "gstcodedexposurefusestate.h"

#define GST_CAT_DEFAULT codedexposure_fuse_debug

namespace cexp::gst::fuse
{

namespace
{

class Events final : public CodedEvents
{
public:
  explicit Events (GstCodedExposureFuse *self)
      : CodedEvents (GST_ELEMENT (self), state (self).stream), self_ (self)
  {
  }

private:
  gboolean forward (EventPtr event) override
  {
    return gst_pad_push_event (state (self_).srcpad, event.release ());
  }
  bool has_plan () const override
  {
    return state (self_).stream.plan.has_value ();
  }
  bool negotiate () override { return fuse::negotiate (self_) == GST_FLOW_OK; }
  void drain () override { fuse::drain (self_); }
  void break_time () override
  {
    Stream &stream = state (self_).stream;
    forget_history (self_);
    if (stream.sequence)
      stream.sequence->resync ();
    stream.discont = true;
  }
  void end () override
  {
    end_saturation (GST_ELEMENT (self_), state (self_).stream);
  }
  void gap () override { forget_history (self_); }

  GstCodedExposureFuse *self_;
};

/* Pixels are read when a frame comes, whatever their strides. */
gboolean
answer_allocation (GstQuery *query)
{
  gst_query_add_allocation_meta (query, GST_VIDEO_META_API_TYPE, nullptr);
  return TRUE;
}

/* One frame in is n frames out. */
int
frames_a_frame (GstCodedExposureFuse *self)
{
  const ObjectLock lock (self);
  const auto &schedule = state (self).in_force;
  return schedule ? schedule->slots () : 1;
}

/* Frames that wait for the next one are late by its period; a fused frame k
 * is due only k slots after its coded frame. The time it computes for is what
 * the processing deadline of sinks stands for. */
void
add_latency (GstCodedExposureFuse *self, GstQuery *query)
{
  gboolean live;
  GstClockTime min, max;
  gst_query_parse_latency (query, &live, &min, &max);
  GstClockTime own;
  {
    const ObjectLock lock (self);
    own = state (self).latency;
  }
  min += own;
  if (GST_CLOCK_TIME_IS_VALID (max))
    max += own;
  gst_query_set_latency (query, live, min, max);
}

} // namespace

void
settle_events (GstCodedExposureFuse *self)
{
  Events (self).settle ();
}

gboolean
sink_event (GstPad *pad, GstObject *parent, GstEvent *raw) noexcept
{
  auto *self = GST_CODED_EXPOSURE_FUSE (parent);
  GST_LOG_OBJECT (pad, "%" GST_PTR_FORMAT, raw);
  if (GST_EVENT_TYPE (raw) == GST_EVENT_FLUSH_START)
    hurry (self);
  if (GST_EVENT_TYPE (raw) == GST_EVENT_FLUSH_STOP)
    take_time (self);
  return Events (self).handle (EventPtr (raw));
}

/* QoS stops here: aravissrc holds its object lock while it waits for a frame,
 * so a sink that reports to it waits too, and loses frames for it. */
gboolean
src_event (GstPad *pad, GstObject *parent, GstEvent *event) noexcept
{
  if (GST_EVENT_TYPE (event) != GST_EVENT_QOS)
    return gst_pad_event_default (pad, parent, event);
  gst_event_unref (event);
  return TRUE;
}

gboolean
sink_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept
{
  switch (GST_QUERY_TYPE (query)) {
  case GST_QUERY_CAPS:
    answer_caps (query, sink_caps (GST_CODED_EXPOSURE_FUSE (parent)));
    return TRUE;
  case GST_QUERY_ALLOCATION:
    return answer_allocation (query);
  default:
    return gst_pad_query_default (pad, parent, query);
  }
}

gboolean
src_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept
{
  auto *self = GST_CODED_EXPOSURE_FUSE (parent);
  if (GST_QUERY_TYPE (query) == GST_QUERY_CAPS) {
    answer_caps (query, src_caps (self));
    return TRUE;
  }
  if (!gst_pad_query_default (pad, parent, query))
    return FALSE;
  if (GST_QUERY_TYPE (query) == GST_QUERY_LATENCY)
    add_latency (self, query);
  scale_frames (query, frames_a_frame (self));
  return TRUE;
}

} // namespace cexp::gst::fuse

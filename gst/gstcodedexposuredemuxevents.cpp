/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Events and queries of all pads. */
#include "gstcodedexposuredemuxstate.h"

#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace cexp::gst::demux
{

namespace
{

void
forget_lateness (GstCodedExposureDemux *self)
{
  const auto list = outputs (self);
  const ObjectLock lock (self);
  list->each ([] (const OutputRef &output) {
    output->earliest = GST_CLOCK_TIME_NONE;
    output->proportion = 1.0;
    output->jitter = 0;
  });
}

class Events final : public CodedEvents
{
public:
  explicit Events (GstCodedExposureDemux *self)
      : CodedEvents (GST_ELEMENT (self), state (self).stream), self_ (self)
  {
  }

private:
  gboolean forward (EventPtr event) override
  {
    return demux::forward (self_, std::move (event));
  }
  bool has_plan () const override
  {
    return state (self_).stream.plan.has_value ();
  }
  bool negotiate () override { return demux::negotiate (self_) == GST_FLOW_OK; }
  void break_time () override
  {
    Stream &stream = state (self_).stream;
    if (stream.sequence)
      stream.sequence->resync ();
    stream.live.reset ();
    forget_lateness (self_);
    outputs (self_)->each (
        [] (const OutputRef &output) { output->discont = true; });
  }
  void end () override
  {
    end_saturation (GST_ELEMENT (self_), state (self_).stream);
  }
  void flushed () override { forget_flow (self_); }

  GstCodedExposureDemux *self_;
};

/* A sink says how late a buffer was. What ran before that moment could not be
 * in time either. */
void
note_lateness (GstCodedExposureDemux *self, GstPad *pad, GstEvent *event)
{
  GstQOSType type;
  gdouble proportion = 1.0;
  GstClockTimeDiff jitter = 0;
  GstClockTime time = GST_CLOCK_TIME_NONE;
  gst_event_parse_qos (event, &type, &proportion, &jitter, &time);
  const auto list = outputs (self);
  const ObjectLock lock (self);
  list->each ([&] (const OutputRef &output) {
    if (output->pad.get () != pad)
      return;
    output->proportion = proportion;
    output->jitter = jitter;
    output->earliest =
        GST_CLOCK_TIME_IS_VALID (time)
            ? GstClockTime (std::max<gint64> (gint64 (time) + jitter, 0))
            : GST_CLOCK_TIME_NONE;
  });
}

/* Frames of @pad for each frame that upstream counts. */
int
frames_a_frame (GstCodedExposureDemux *self, GstPad *pad)
{
  const auto list = outputs (self);
  const ObjectLock lock (self);
  const ScheduleRef &schedule = state (self).in_force;
  if (!schedule)
    return 1;
  if (list->all->pad.get () == pad)
    return schedule->elements ();
  const int regions = int (schedule->regions ().size ());
  for (const auto &[index, output] : list->regions)
    if (output->pad.get () == pad && index < regions)
      return schedule->region (index).elements ();
  return 1;
}

} // namespace

void
settle_events (GstCodedExposureDemux *self)
{
  Events (self).settle ();
}

gboolean
sink_event (GstPad *pad, GstObject *parent, GstEvent *raw) noexcept
{
  GST_LOG_OBJECT (pad, "%" GST_PTR_FORMAT, raw);
  return Events (GST_CODED_EXPOSURE_DEMUX (parent)).handle (EventPtr (raw));
}

/* QoS stops here: aravissrc holds its object lock while it waits for a frame,
 * so a sink that reports to it waits too, and loses frames for it. */
gboolean
src_event (GstPad *pad, GstObject *parent, GstEvent *raw) noexcept
{
  if (GST_EVENT_TYPE (raw) != GST_EVENT_QOS)
    return gst_pad_event_default (pad, parent, raw);
  const EventPtr event (raw);
  note_lateness (GST_CODED_EXPOSURE_DEMUX (parent), pad, raw);
  return TRUE;
}

gboolean
sink_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (parent);
  switch (GST_QUERY_TYPE (query)) {
  case GST_QUERY_CAPS:
    answer_caps (query, sink_caps (self));
    return TRUE;
  case GST_QUERY_ALLOCATION:
    return answer_allocation (self, query);
  default:
    return gst_pad_query_default (pad, parent, query);
  }
}

/* LATENCY is upstream's own: the demultiplexer holds no frame back, and
 * subframe k is due k slots after its frame. The time it computes for is what
 * the processing deadline of sinks stands for. */
gboolean
src_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (parent);
  if (GST_QUERY_TYPE (query) == GST_QUERY_CAPS) {
    answer_caps (query, src_caps (self, pad));
    return TRUE;
  }
  if (!gst_pad_query_default (pad, parent, query))
    return FALSE;
  scale_frames (query, frames_a_frame (self, pad));
  return TRUE;
}

} // namespace cexp::gst::demux

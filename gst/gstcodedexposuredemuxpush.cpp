/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A coded frame comes in, its subframes go out. */
#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "extract/saturation.h"
#include "gstcodedexposuredemuxstate.h"

#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace cexp::gst::demux
{

namespace
{

/* One coded frame on its way through the element. */
struct Job {
  GstBuffer *inbuf;
  GstClockTime pts;
  FrameMeta meta;
  std::shared_ptr<const Outputs> outputs;
  bool backwards; ///< reverse playback: the last subframe goes first
};

/* The pads that a subframe goes to; null where it does not. */
struct Targets {
  Output *all = nullptr;
  Output *one = nullptr;
  BufferPtr buffer;
  Output *owner () const { return all ? all : one; }
};

/* NOT_LINKED and EOS of one pad leave the others to go on. */
bool
is_fatal (GstFlowReturn flow)
{
  return flow == GST_FLOW_FLUSHING || flow <= GST_FLOW_NOT_NEGOTIATED;
}

/* Asked only for the sake of QoS messages. */
bool
is_live (GstCodedExposureDemux *self)
{
  DemuxState &st = state (self);
  if (!st.stream.live) {
    const QueryPtr query (gst_query_new_latency ());
    gboolean live = FALSE;
    if (gst_pad_peer_query (st.sinkpad, query.get ()))
      gst_query_parse_latency (query.get (), &live, nullptr, nullptr);
    st.stream.live = live;
  }
  return *st.stream.live;
}

/* Says that @output goes without a subframe, to it and on the bus. */
void
skip (GstCodedExposureDemux *self, Output &output, GstClockTime pts,
    GstClockTime duration)
{
  const GstSegment &segment = state (self).stream.segment;
  const auto running =
      gst_segment_to_running_time (&segment, GST_FORMAT_TIME, pts);
  const auto stream_time =
      gst_segment_to_stream_time (&segment, GST_FORMAT_TIME, pts);
  GstMessage *message = gst_message_new_qos (
      GST_OBJECT (self), is_live (self), running, stream_time, pts, duration);
  {
    const ObjectLock lock (self);
    Counters &counters = state (self).counters;
    counters.subframes_dropped++;
    gst_message_set_qos_values (
        message, output.jitter, output.proportion, 1000000);
    gst_message_set_qos_stats (message, GST_FORMAT_BUFFERS,
        counters.subframes_out, counters.subframes_dropped);
  }
  gst_element_post_message (GST_ELEMENT (self), message);
  output.discont = true;
  gst_pad_push_event (output.pad.get (), gst_event_new_gap (pts, duration));
}

bool
is_late (GstCodedExposureDemux *self, const Output &output, GstClockTime pts,
    GstClockTime duration)
{
  const Stream &stream = state (self).stream;
  if (!stream.settings.qos)
    return false;
  GstClockTime earliest;
  {
    const ObjectLock lock (self);
    earliest = output.earliest;
  }
  const GstClockTime running = gst_segment_to_running_time (&stream.segment,
      GST_FORMAT_TIME, stream.segment.rate < 0 ? pts + duration : pts);
  return GST_CLOCK_TIME_IS_VALID (earliest) &&
         GST_CLOCK_TIME_IS_VALID (running) && running < earliest;
}

/* The subframes of one part of the frame, and where they go. */
struct Work {
  const Part *part;
  std::vector<Targets> targets;

  bool wanted () const
  {
    return std::any_of (targets.begin (), targets.end (),
        [] (const Targets &target) { return target.owner (); });
  }
};

/* Subframes in the order in which they are pushed. */
std::vector<std::size_t>
push_order (const Job &job, std::size_t n)
{
  std::vector<std::size_t> order (n);
  std::iota (order.begin (), order.end (), 0);
  if (job.backwards)
    std::reverse (order.begin (), order.end ());
  return order;
}

/* A pad that is not linked gets nothing made for it, but has its say in the
 * flow. */
bool
prepare_output (GstCodedExposureDemux *self, Output &output, guint at_once,
    GstFlowReturn &flow)
{
  if (!is_wanted (output)) {
    flow = combine_flow (self, output, GST_FLOW_NOT_LINKED);
    return false;
  }
  prepare_allocation (self, output, at_once);
  return true;
}

/* The pad that gets all subframes of @part; null where nobody asked for it. */
Output *
raised_output (const Job &job, const Part &part)
{
  if (part.region < 0)
    return job.outputs->all.get ();
  const auto found = job.outputs->regions.find (part.region);
  return found == job.outputs->regions.end () ? nullptr : found->second.get ();
}

/* Finds where every subframe of @part has to go, but for those that are outside
 * of the segment; says so where one is late, and left out. */
Work
find_targets (GstCodedExposureDemux *self, const Job &job, const Part &part,
    GstFlowReturn &flow)
{
  const auto &bounds = part.boundaries;
  Work work{&part, std::vector<Targets> (std::size_t (part.subframes ()))};
  std::vector<Targets> &targets = work.targets;
  const auto aim = [&] (Output &output, std::size_t k, GstClockTime duration,
                       Output *&target) {
    const GstClockTime pts = job.pts + bounds[k];
    if (!is_within (state (self).stream.segment, pts, duration))
      return;
    if (is_late (self, output, pts, duration))
      skip (self, output, pts, duration);
    else
      target = &output;
  };

  Output *const all = raised_output (job, part);
  if (all && prepare_output (self, *all, guint (targets.size ()), flow)) {
    for (std::size_t k : push_order (job, targets.size ()))
      aim (*all, k, bounds[k + 1] - bounds[k], targets[k].all);
  }
  if (part.region >= 0)
    return work;
  for (const auto &[index, output] : job.outputs->ones) {
    const auto k = std::size_t (index);
    if (prepare_output (self, *output, 1, flow))
      aim (*output, k, part.period (), targets[k].one);
  }
  return work;
}

/* Room for a subframe that nobody wants: the extractor writes all of them. */
template <typename Pixel>
ImageView<Pixel>
scratch_view (Stream &stream, const Part &part, std::size_t k)
{
  const GstVideoInfo &info = part.subframe;
  const std::size_t row = std::size_t (info.width) * sizeof (Pixel);
  const std::size_t plane = row * std::size_t (info.height);
  const std::size_t size = plane * std::size_t (part.subframes ());
  if (stream.scratch.size () < size)
    stream.scratch.resize (size);
  return {reinterpret_cast<Pixel *> (stream.scratch.data () + k * plane),
      info.width, info.height, std::ptrdiff_t (row)};
}

template <typename Pixel>
ExtractReport
extract (const Extractor<Pixel> &extractor, Stream &stream, const Part &part,
    ImageView<const Pixel> light, std::vector<MappedFrame> &subframes)
{
  std::vector<ImageView<Pixel>> views;
  views.reserve (subframes.size ());
  for (std::size_t k = 0; k < subframes.size (); k++)
    views.push_back (subframes[k] ? view_of<Pixel> (subframes[k])
                                  : scratch_view<Pixel> (stream, part, k));
  const Rect &rect = part.rect;
  return extractor.run (
      light.block (rect.x, rect.y, rect.width, rect.height), views);
}

/* Takes a buffer for every subframe that has a target and maps it; a subframe
 * that has none is left unmapped. */
GstFlowReturn
map_subframes (GstCodedExposureDemux *self, Work &work,
    std::vector<MappedFrame> &subframes)
{
  const GstVideoInfo &info = work.part->subframe;
  subframes.reserve (work.targets.size ());
  for (Targets &target : work.targets) {
    if (!target.owner ()) {
      subframes.emplace_back ();
      continue;
    }
    const GstFlowReturn flow = acquire (*target.owner (), target.buffer);
    if (flow == GST_FLOW_FLUSHING)
      return flow;
    if (target.buffer)
      subframes.emplace_back (info, target.buffer.get (), GST_MAP_WRITE);
    if (!target.buffer || !subframes.back ()) {
      GST_ELEMENT_ERROR (self, RESOURCE, NO_SPACE_LEFT,
          ("No buffer for a subframe of %dx%d pixels.", info.width,
              info.height),
          ("pool %" GST_PTR_FORMAT, target.owner ()->allocation->pool.get ()));
      return GST_FLOW_ERROR;
    }
  }
  return GST_FLOW_OK;
}

/* Fills the buffers of @work, which is wanted, from @light, one pixel a
 * mirror. */
template <typename Pixel>
GstFlowReturn
render_part (GstCodedExposureDemux *self, Job &job, Work &work,
    ImageView<const Pixel> light)
{
  std::vector<MappedFrame> subframes;
  const GstFlowReturn flow = map_subframes (self, work, subframes);
  if (flow != GST_FLOW_OK)
    return flow;
  const auto &extractor = std::get<Extractor<Pixel>> (work.part->extractor);
  job.meta.saturated =
      extract (extractor, state (self).stream, *work.part, light, subframes)
          .saturated;
  return GST_FLOW_OK;
}

/* Fills the buffers of all @works. */
template <typename Pixel>
GstFlowReturn
render (GstCodedExposureDemux *self, Job &job, std::vector<Work> &works)
{
  Stream &stream = state (self).stream;
  const Plan &plan = *stream.plan;
  MappedFrame coded (plan.coded, job.inbuf, GST_MAP_READ);
  if (!coded) {
    GST_ELEMENT_ERROR (self, STREAM, FORMAT,
        ("A coded frame of %" G_GSIZE_FORMAT " bytes cannot be read as %dx%d "
         "pixels, which take %" G_GSIZE_FORMAT ".",
            gst_buffer_get_size (job.inbuf), plan.coded.width,
            plan.coded.height, GST_VIDEO_INFO_SIZE (&plan.coded)),
        (nullptr));
    return GST_FLOW_ERROR;
  }
  ImageView<const Pixel> light = view_of<const Pixel> (coded);
  if (plan.rectifier)
    light = rectify (stream, *plan.rectifier, light, stream.bits_in_force ());
  GstFlowReturn flow = GST_FLOW_OK;
  for (Work &work : works)
    if (work.wanted () && flow == GST_FLOW_OK)
      flow = render_part (self, job, work, light);
  /* Each extractor counts the cells of its own part. */
  if (works.size () > 1)
    job.meta.saturated = count_saturated (
        light.rows (0, light.height - plan.schedule.pilot_rows ()),
        stream.bits_in_force ());
  return flow;
}

/* What all pads that get subframe @k see alike. */
void
describe_subframe (GstCodedExposureDemux *self, const Job &job,
    const Part &part, std::size_t k, GstBuffer *outbuf)
{
  gst_buffer_copy_into (outbuf, job.inbuf, GST_BUFFER_COPY_FLAGS, 0, -1);
  GST_BUFFER_FLAG_UNSET (outbuf, GST_BUFFER_FLAG_MARKER);
  if (part.region < 0)
    copy_metas (
        job.inbuf, state (self).stream.plan->coded, outbuf, part.subframe);
  else
    copy_metas_to_part (job.inbuf, outbuf);

  FrameMeta meta = job.meta;
  meta.subframe = gint (k);
  meta.bits = told_bits (state (self).stream.bits_in_force (), part.subframe);
  meta.exposure_start = job.pts + part.windows[k].start;
  meta.exposure_duration = part.windows[k].duration;
  set_frame_meta (outbuf, meta);
  GST_BUFFER_PTS (outbuf) = job.pts + part.boundaries[k];
  GST_BUFFER_DTS (outbuf) = GST_CLOCK_TIME_NONE;
}

/* Sets or clears a flag that must not be inherited from the coded frame. */
void
mark_discont (Output &output, GstBuffer *outbuf)
{
  if (std::exchange (output.discont, false)) {
    GST_BUFFER_FLAG_SET (outbuf, GST_BUFFER_FLAG_DISCONT);
  } else {
    GST_BUFFER_FLAG_UNSET (outbuf, GST_BUFFER_FLAG_DISCONT);
    GST_BUFFER_FLAG_UNSET (outbuf, GST_BUFFER_FLAG_RESYNC);
  }
}

/* @outbuf: writable, taken. */
GstFlowReturn
push_on (GstCodedExposureDemux *self, Output &output, BufferPtr outbuf,
    GstClockTime duration)
{
  GST_BUFFER_DURATION (outbuf.get ()) = duration;
  GST_BUFFER_OFFSET (outbuf.get ()) = output.offset++;
  GST_BUFFER_OFFSET_END (outbuf.get ()) = output.offset;
  mark_discont (output, outbuf.get ());
  GST_LOG_OBJECT (output.pad.get (), "[OUT] %" GST_PTR_FORMAT, outbuf.get ());
  return combine_flow (
      self, output, gst_pad_push (output.pad.get (), outbuf.release ()));
}

/* @outbuf once more, in the same memory unless the peer of @output could not
 * read its layout. */
BufferPtr
share (const Part &part, const Output &output, GstBuffer *outbuf)
{
  const GstVideoMeta *layout = gst_buffer_get_video_meta (outbuf);
  const bool plain =
      !layout || (layout->offset[0] == part.subframe.offset[0] &&
                     layout->stride[0] == part.subframe.stride[0]);
  if (plain || output.allocation->video_meta)
    return BufferPtr (gst_buffer_copy (outbuf));

  BufferPtr packed (gst_buffer_new_allocate (
      nullptr, GST_VIDEO_INFO_SIZE (&part.subframe), nullptr));
  gst_buffer_copy_into (packed.get (), outbuf,
      GstBufferCopyFlags (GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS),
      0, -1);
  copy_metas (outbuf, part.subframe, packed.get (), part.subframe);
  MappedFrame from (part.subframe, outbuf, GST_MAP_READ);
  MappedFrame to (part.subframe, packed.get (), GST_MAP_WRITE);
  if (from && to)
    gst_video_frame_copy (to.frame (), from.frame ());
  return packed;
}

GstFlowReturn
push_subframe (GstCodedExposureDemux *self, const Job &job, const Part &part,
    std::size_t k, Targets target)
{
  describe_subframe (self, job, part, k, target.buffer.get ());
  BufferPtr second;
  if (target.all && target.one)
    second = share (part, *target.one, target.buffer.get ());

  GstFlowReturn flow = GST_FLOW_OK;
  if (target.all)
    flow = push_on (self, *target.all, std::move (target.buffer),
        part.boundaries[k + 1] - part.boundaries[k]);
  else
    second = std::move (target.buffer);
  if (target.one && !is_fatal (flow))
    flow = push_on (self, *target.one, std::move (second), part.period ());
  return flow;
}

/* The recorder of coded frames must not wait for a display of subframes, so
 * this pad comes first. */
GstFlowReturn
push_coded (GstCodedExposureDemux *self, const Job &job)
{
  const OutputRef &output = job.outputs->coded;
  if (!output)
    return GST_FLOW_OK;
  BufferPtr outbuf (gst_buffer_ref (job.inbuf));
  if (std::exchange (output->discont, false) &&
      !GST_BUFFER_IS_DISCONT (job.inbuf)) {
    outbuf.reset (gst_buffer_make_writable (outbuf.release ()));
    GST_BUFFER_FLAG_SET (outbuf.get (), GST_BUFFER_FLAG_DISCONT);
  }
  GST_LOG_OBJECT (output->pad.get (), "[OUT] %" GST_PTR_FORMAT, outbuf.get ());
  return combine_flow (
      self, *output, gst_pad_push (output->pad.get (), outbuf.release ()));
}

/* A subframe of one of several parts. */
struct Turn {
  GstClockTime at; ///< from the start of the frame
  Work *work;
  std::size_t k;
};

/* The subframes of all parts in the order of time, those of the background
 * first; backwards where the stream plays so. */
std::vector<Turn>
take_turns (const Job &job, std::vector<Work> &works)
{
  std::vector<Turn> turns;
  for (Work &work : works)
    for (const std::size_t k : push_order (job, work.targets.size ()))
      if (work.targets[k].owner ())
        turns.push_back ({work.part->boundaries[k], &work, k});
  if (works.size () > 1)
    std::stable_sort (
        turns.begin (), turns.end (), [&] (const Turn &a, const Turn &b) {
          return job.backwards ? a.at > b.at : a.at < b.at;
        });
  return turns;
}

GstFlowReturn
push_subframes (GstCodedExposureDemux *self, Job &job)
{
  Stream &stream = state (self).stream;
  GstFlowReturn flow = GST_FLOW_OK;
  std::vector<Work> works;
  for (const Part &part : stream.plan->parts)
    works.push_back (find_targets (self, job, part, flow));
  std::vector<Turn> turns = take_turns (job, works);
  if (turns.empty ())
    return flow;
  flow = GST_VIDEO_INFO_FORMAT (&stream.plan->coded) == GST_VIDEO_FORMAT_GRAY8
             ? render<std::uint8_t> (self, job, works)
             : render<std::uint16_t> (self, job, works);
  if (flow != GST_FLOW_OK)
    return flow;
  if (!GST_BUFFER_FLAG_IS_SET (job.inbuf, GST_BUFFER_FLAG_GAP))
    note_saturation (
        GST_ELEMENT (self), stream, state (self).counters, job.pts, job.meta);

  for (const auto &[at, work, k] : turns)
    if (!is_fatal (flow))
      flow = push_subframe (
          self, job, *work->part, k, std::move (work->targets[k]));
  return flow;
}

/* Counts and judges the frame before anything of it goes out. */
Job
take_in (GstCodedExposureDemux *self, GstBuffer *inbuf)
{
  DemuxState &st = state (self);
  const Admitted admitted = admit (GST_ELEMENT (self), st.stream, st.counters,
      inbuf, st.stream.plan->period ());
  Job job{inbuf, GST_BUFFER_PTS (inbuf), admitted.meta, outputs (self),
      st.stream.backwards ()};
  if (!admitted.follows)
    job.outputs->each (
        [] (const OutputRef &output) { output->discont = true; });
  return job;
}

} // namespace

/* The subframes of one coded frame, in the order of their exposure. One
 * thread serves all pads, so that a sink that waits for its time makes the
 * others wait: users put a queue after every pad. Buffers are pushed one by
 * one, because a sink would show a whole list at the time of its first. */
GstFlowReturn
chain (GstPad *pad, GstObject *parent, GstBuffer *inbuf) noexcept
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (parent);
  Stream &stream = state (self).stream;
  BufferPtr frame (inbuf);
  GST_LOG_OBJECT (pad, "[IN] %" GST_PTR_FORMAT, inbuf);
  GstFlowReturn flow = check_stamp (GST_ELEMENT (self), stream, inbuf);
  if (flow == GST_FLOW_OK)
    flow = negotiate (self, inbuf);
  if (flow == GST_FLOW_OK)
    frame = uncut (pad, stream, std::move (frame), stream.plan->period ());
  if (flow != GST_FLOW_OK || !frame)
    return flow;

  Job job = take_in (self, frame.get ());
  if (!check_pads (self, *job.outputs))
    return GST_FLOW_NOT_NEGOTIATED;
  flow = push_coded (self, job);
  return is_fatal (flow) ? flow : push_subframes (self, job);
}

} // namespace cexp::gst::demux

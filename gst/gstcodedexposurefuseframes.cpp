/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A coded frame comes in, its fused frames go out. */
#include <algorithm>

#include "extract/saturation.h"
#include "gstcodedexposurefusestate.h"

#define GST_CAT_DEFAULT codedexposure_fuse_debug

namespace cexp::gst::fuse
{

namespace
{

/* Flags of frames that are no picture, or none to compare others with. */
constexpr guint kUnfit = GST_BUFFER_FLAG_CORRUPTED | GST_BUFFER_FLAG_GAP;

/* Counts the frame; ends the history where it does not follow the last one. */
GstFlowReturn
take_in (GstCodedExposureFuse *self, GstBuffer *inbuf, FrameMeta &meta)
{
  FuseState &st = state (self);
  const Admitted admitted = admit (GST_ELEMENT (self), st.stream, st.counters,
      inbuf, st.stream.plan->period ());
  meta = admitted.meta;
  if (admitted.follows && !(GST_BUFFER_FLAGS (inbuf) & kUnfit))
    return GST_FLOW_OK;
  const GstFlowReturn flow = drain (self);
  forget_history (self);
  st.stream.discont |= !admitted.follows;
  return flow;
}

/* Returns the number of saturated pixels. */
template <typename Pixel>
guint64
take_pixels (Stream &stream, ImageView<const Pixel> coded)
{
  const int bits = stream.bits_in_force ();
  const guint64 saturated = count_saturated (coded, bits);
  if (const Rectifier *rectifier = stream.plan->rectifier.get ())
    coded = rectify (stream, *rectifier, coded, bits);
  std::get<Fuser<Pixel>> (stream.plan->fuser).take (coded);
  return saturated;
}

/* Gives the pixels of @inbuf to the fuser and keeps the rest. */
GstFlowReturn
take (GstCodedExposureFuse *self, GstBuffer *inbuf, FrameMeta meta)
{
  FuseState &st = state (self);
  Stream &stream = st.stream;
  Plan &plan = *stream.plan;
  MappedFrame coded (plan.coded, inbuf, GST_MAP_READ);
  if (!coded) {
    GST_ELEMENT_ERROR (self, STREAM, FORMAT,
        ("A coded frame of %" G_GSIZE_FORMAT " bytes cannot be read as %dx%d "
         "pixels, which take %" G_GSIZE_FORMAT ".",
            gst_buffer_get_size (inbuf), plan.coded.width, plan.coded.height,
            GST_VIDEO_INFO_SIZE (&plan.coded)),
        (nullptr));
    return GST_FLOW_ERROR;
  }
  meta.saturated =
      GST_VIDEO_INFO_FORMAT (&plan.coded) == GST_VIDEO_FORMAT_GRAY8
          ? take_pixels (stream, view_of<const std::uint8_t> (coded))
          : take_pixels (stream, view_of<const std::uint16_t> (coded));
  if (!GST_BUFFER_FLAG_IS_SET (inbuf, GST_BUFFER_FLAG_GAP))
    note_saturation (
        GST_ELEMENT (self), stream, st.counters, GST_BUFFER_PTS (inbuf), meta);

  BufferPtr description (gst_buffer_new ());
  gst_buffer_copy_into (description.get (), inbuf,
      GstBufferCopyFlags (GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS),
      0, -1);
  copy_metas (inbuf, plan.coded, description.get (), plan.fused);
  stream.waiting.push_back ({std::move (description), meta});
  return GST_FLOW_OK;
}

/* False when it was stopped. */
template <typename Pixel>
bool
fill (
    Fuser<Pixel> &fuser, std::vector<MappedFrame> &mapped, std::stop_token stop)
{
  std::vector<ImageView<Pixel>> views;
  for (MappedFrame &frame : mapped)
    views.push_back (view_of<Pixel> (frame));
  return fuser.fuse (views, std::move (stop));
}

/* The frames of the oldest coded frame that waits; none on an error, which is
 * posted unless it is a flush. */
std::vector<BufferPtr>
render (GstCodedExposureFuse *self, GstFlowReturn &flow)
{
  Plan &plan = *state (self).stream.plan;
  std::vector<BufferPtr> buffers;
  std::vector<MappedFrame> mapped;
  for (int k = 0; k < plan.schedule.slots (); k++) {
    GstBuffer *buffer = nullptr;
    flow = gst_buffer_pool_acquire_buffer (plan.pool.get (), &buffer, nullptr);
    if (flow == GST_FLOW_OK) {
      buffers.emplace_back (buffer);
      mapped.emplace_back (plan.fused, buffer, GST_MAP_WRITE);
    }
    if (flow == GST_FLOW_OK && mapped.back ())
      continue;
    if (flow == GST_FLOW_FLUSHING)
      return {};
    GST_ELEMENT_ERROR (self, RESOURCE, NO_SPACE_LEFT,
        ("No buffer for a fused frame of %dx%d pixels.", plan.fused.width,
            plan.fused.height),
        (nullptr));
    flow = GST_FLOW_ERROR;
    return {};
  }
  const std::stop_token stop = [self] {
    const ObjectLock lock (self);
    return state (self).hurry.get_token ();
  }();
  const bool done = std::visit (
      [&] (auto &fuser) { return fill (fuser, mapped, stop); }, plan.fuser);
  if (done)
    return buffers;
  flow = GST_FLOW_FLUSHING;
  return {};
}

void
describe (
    GstCodedExposureFuse *self, const Waiting &coded, int k, GstBuffer *outbuf)
{
  Stream &stream = state (self).stream;
  const Plan &plan = *stream.plan;
  GstBuffer *description = coded.description.get ();
  const GstClockTime pts = GST_BUFFER_PTS (description);
  gst_buffer_copy_into (outbuf, description, GST_BUFFER_COPY_FLAGS, 0, -1);
  GST_BUFFER_FLAG_UNSET (outbuf, GST_BUFFER_FLAG_MARKER);
  copy_metas (description, plan.fused, outbuf, plan.fused);

  FrameMeta meta = coded.meta;
  meta.subframe = k;
  meta.bits = told_bits (stream.bits_in_force (), plan.fused);
  meta.exposure_start = pts + GstClockTime (plan.slots.start (k));
  meta.exposure_duration = GstClockTime (plan.slots.active ());
  set_frame_meta (outbuf, meta);
  GST_BUFFER_PTS (outbuf) = pts + plan.boundary (k);
  GST_BUFFER_DTS (outbuf) = GST_CLOCK_TIME_NONE;
  GST_BUFFER_DURATION (outbuf) = plan.boundary (k + 1) - plan.boundary (k);
  GST_BUFFER_OFFSET (outbuf) = stream.offset++;
  GST_BUFFER_OFFSET_END (outbuf) = stream.offset;
  if (std::exchange (stream.discont, false)) {
    GST_BUFFER_FLAG_SET (outbuf, GST_BUFFER_FLAG_DISCONT);
  } else {
    GST_BUFFER_FLAG_UNSET (outbuf, GST_BUFFER_FLAG_DISCONT);
    GST_BUFFER_FLAG_UNSET (outbuf, GST_BUFFER_FLAG_RESYNC);
  }
}

/* Buffers are pushed one by one, because a sink would show a whole list at the
 * time of its first. */
GstFlowReturn
push_oldest (GstCodedExposureFuse *self)
{
  FuseState &st = state (self);
  GstFlowReturn flow = GST_FLOW_OK;
  std::vector<BufferPtr> buffers = render (self, flow);
  const Waiting coded = std::move (st.stream.waiting.front ());
  st.stream.waiting.pop_front ();
  if (flow == GST_FLOW_FLUSHING)
    forget_history (self);
  const int n = int (buffers.size ());
  for (int i = 0; i < n && flow == GST_FLOW_OK; i++) {
    const int k = st.stream.segment.rate < 0 ? n - 1 - i : i;
    if (!is_within (st.stream.segment,
            GST_BUFFER_PTS (coded.description.get ()) +
                st.stream.plan->boundary (k),
            st.stream.plan->boundary (k + 1) - st.stream.plan->boundary (k)))
      continue;
    BufferPtr &outbuf = buffers[std::size_t (k)];
    describe (self, coded, k, outbuf.get ());
    GST_LOG_OBJECT (st.srcpad, "[OUT] %" GST_PTR_FORMAT, outbuf.get ());
    flow = gst_pad_push (st.srcpad, outbuf.release ());
    if (flow != GST_FLOW_OK)
      break;
    const ObjectLock lock (self);
    st.counters.frames_out++;
  }
  return flow;
}

} // namespace

GstFlowReturn
drain (GstCodedExposureFuse *self)
{
  const Stream &stream = state (self).stream;
  GstFlowReturn flow = GST_FLOW_OK;
  while (!stream.waiting.empty () && flow == GST_FLOW_OK)
    flow = push_oldest (self);
  return flow;
}

void
forget_history (GstCodedExposureFuse *self)
{
  Stream &stream = state (self).stream;
  stream.waiting.clear ();
  if (stream.plan)
    std::visit ([] (auto &fuser) { fuser.forget (); }, stream.plan->fuser);
}

GstFlowReturn
chain (GstPad *pad, GstObject *parent, GstBuffer *inbuf) noexcept
{
  auto *self = GST_CODED_EXPOSURE_FUSE (parent);
  BufferPtr frame (inbuf);
  Stream &stream = state (self).stream;
  GST_LOG_OBJECT (pad, "[IN] %" GST_PTR_FORMAT, inbuf);
  FrameMeta meta;
  GstFlowReturn flow = check_stamp (GST_ELEMENT (self), stream, inbuf);
  if (flow == GST_FLOW_OK)
    flow = negotiate (self, inbuf);
  if (flow == GST_FLOW_OK)
    frame = uncut (pad, stream, std::move (frame), stream.plan->period ());
  inbuf = frame.get ();
  if (!inbuf)
    return flow;
  if (flow == GST_FLOW_OK)
    flow = take_in (self, inbuf, meta);
  if (flow == GST_FLOW_OK)
    flow = take (self, inbuf, meta);
  if (flow == GST_FLOW_OK && GST_BUFFER_FLAGS (inbuf) & kUnfit) {
    flow = drain (self);
    forget_history (self);
  }
  while (flow == GST_FLOW_OK &&
         int (stream.waiting.size ()) > stream.plan->lookahead)
    flow = push_oldest (self);
  return flow;
}

} // namespace cexp::gst::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-demux
 * @title: codedexposure-demux
 * @short_description: Splits coded frames into subframes
 *
 * Takes the frames of a camera behind a micromirror device, in which
 * neighbouring pixels saw different parts of the exposure, and gives n
 * subframes for each: pictures of lower resolution at n times the frame rate.
 *
 * ## Pads
 *
 * - `src`: all subframes in the order of their exposure. Subframe k of a frame
 *   at time P, of a camera with frame period T, has PTS P + floor (k T / n) and
 *   lasts until the next one; OFFSET counts subframes.
 * - `subframe_0` to `subframe_<n-1>` (request): one subframe of every frame,
 *   at the camera's rate; the same memory as on `src`.
 * - `region_<i>` (request): all subframes of region i of the schedule, at the
 *   camera's rate times the region's own n.
 * - `coded` (request): the coded frames, the same memory as they came in. It
 *   is served first, so that a recorder never waits for a display.
 *
 * One thread serves all pads: put a `queue` after each.
 *
 * |[
 *   coded frame   |P                              |P + T
 *   src           |0      |1      |2      |3      |0 ...
 *   subframe_2    |               |P + 2T/4, lasts T
 * ]|
 *
 * The period comes from the caps, or from #GstCodedFilter:frame-rate
 * where they have none; a lost frame never stretches its neighbours.
 *
 * A seek gives all subframes of the coded frames whose times lie in the
 * segment, and no others.
 *
 * ## Schedule
 *
 * The schedule defines which pixel saw which part of the exposure. It is the
 * #GstCodedFilter:schedule property, else that of the stream's tag
 * `comment=coded-exposure={...}`, else sequential:2x2 with a warning on the
 * bus. Source pads get their caps with the first frame, because tags come after
 * caps. Width and height are divided by the cell of the tile, and
 * pixel-aspect-ratio follows; columns and rows that fill no cell, and the
 * pilot's rows, are cropped.
 *
 * Where the schedule has regions, areas with a tile and a code of their own,
 * `src` and `subframe_<k>` show the background, which has the tile and the code
 * of the schedule; pixels that a region touches are black. Subframes of a
 * region have their own size, rate and times. Pads are served in the order of
 * time. All parts get the same brightness, but #codedexposure-demux:method
 * `select`, if it is set by name, keeps the camera's values.
 *
 * ## Mapping
 *
 * A mapping corrects a camera that is not exactly aligned with the mirrors. It
 * is that of the #GstCodedFilter:mapping property, else that of the stream's
 * tag. Frames are rectified to one pixel a mirror before they are split;
 * regions are places among the mirrors, wherever the camera sees them. The
 * element message `codedexposure/mapping` reports how well it sees them.
 *
 * ## Flags, metas and messages
 *
 * A gap of more than one and a half periods between two frames is a loss: it is
 * counted, the next subframe of every pad is DISCONT, and the element message
 * `codedexposure/frames-lost` has `count`, `from` (when the first was due) and
 * `to` (the frame that came). CORRUPTED and GAP pass to all subframes of a
 * frame. Frames whose meta names a pattern do not show the schedule: they pass
 * on the `coded` pad only, a GAP event takes the place of their subframes, and
 * `codedexposure/not-coded` names the pattern.
 * `codedexposure/saturated` reports when a sequence of frames with
 * pixels at the largest value begins (`active` true), and when there were none
 * for a second.
 *
 * Every subframe has the custom meta `CodedExposureFrame` with the number of
 * its frame, its index and the time of its light; other metas of the frame are
 * copied.
 *
 * ## Latency and quality of service
 *
 * The element adds no latency: it holds no frame back, and subframe k is due
 * only k slots after its frame. It drops subframes only if
 * #codedexposure-demux:qos is set and a sink would drop them, and posts a QoS
 * message for each. QoS events are not forwarded upstream, because some camera
 * sources stop their stream for them.
 *
 * ## Example pipelines
 *
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim schedule=staircase:2x2 ! codedexposure-demux \
 *     ! queue ! videoconvert ! autovideosink
 * ]| A simulated bench, shown at the raised rate.
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim ! codedexposure-demux name=demux \
 *     demux.src ! queue ! videoconvert ! autovideosink \
 *     demux.coded ! queue ! avenc_ffv1 ! matroskamux ! filesink location=a.mkv
 * ]| The same, and a recording of the coded frames.
 *
 * Since: 0.1
 */
#include "demux.h"

#include <algorithm>
#include <utility>

#include "common/element.h"
#include "common/elements.h"
#include "extract/saturation.h"

GST_DEBUG_CATEGORY (codedexposure_demux_debug);
#define GST_CAT_DEFAULT codedexposure_demux_debug

using namespace codedexposure;
using namespace codedexposure::gst;

namespace codedexposure::gst::demux
{

void
Demux::set_up_class (gpointer klass)
{
  GST_DEBUG_CATEGORY_INIT (codedexposure_demux_debug, "codedexposure-demux", 0,
      "coded frames to subframes");
  install_properties<properties, settings_of, settings_changed> (
      G_OBJECT_CLASS (klass));
  describe_element (klass, "Coded exposure demultiplexer",
      "Filter/Effect/Video",
      "Splits the frames of a camera behind a micromirror device into "
      "subframes at a multiple of the frame rate",
      {});
  for (const char *pad : {"subframe_%u", "region_%u"})
    add_pad_template (
        klass, pad, {.presence = GST_PAD_REQUEST, .type = coded_pad_type ()});
}

namespace
{

/* Whether any subframe of a part has a pad to go to. */
bool
any_wanted (const auto &targets)
{
  return std::ranges::any_of (
      targets, [] (const auto &target) { return target.owner (); });
}

} // namespace

Demux::Demux (GstElement *element)
    : CodedFilter (element, {"application/x-codedexposure-demux-stats",
                                "subframes-out", "subframes-dropped"})
{
}

/* One thread serves all pads, so a sink that waits for its time delays the
 * others: users put a queue after every pad. Buffers are pushed one by one,
 * because a sink would show a whole list at the time of its first buffer. */
GstFlowReturn
Demux::process (CodedFrame frame)
{
  const auto served = pads ();
  return check_pads (*served) ? push_subframes (frame, *served)
                              : GST_FLOW_NOT_NEGOTIATED;
}

GstFlowReturn
Demux::push_subframes (CodedFrame &frame, const PadMap &pads)
{
  GstFlowReturn flow = GST_FLOW_OK;
  std::vector<Targets> parts;
  for (const SplitPart &part : plan_->parts)
    parts.push_back (find_targets (frame, pads, part, flow));
  if (std::ranges::none_of (parts, any_wanted<Targets>))
    return flow;
  flow = format ().wide () ? render<std::uint16_t> (frame, parts)
                           : render<std::uint8_t> (frame, parts);
  if (flow != GST_FLOW_OK)
    return flow;
  note_saturation (frame);

  for (const SplitTurn &turn : plan_->turns[backwards ()]) {
    Target &target = parts[turn.part][turn.subframe];
    if (target.owner () && !is_fatal (flow))
      flow = push_subframe (frame, turn, std::move (target));
  }
  return flow;
}

/* --------------------------------------------------- where subframes go -- */

/* QoS messages need it; nothing else does. */
bool
Demux::is_live ()
{
  if (!live_) {
    const QueryPtr query (gst_query_new_latency ());
    gboolean live = FALSE;
    if (gst_pad_peer_query (sinkpad (), query.get ()))
      gst_query_parse_latency (query.get (), &live, nullptr, nullptr);
    live_ = live;
  }
  return *live_;
}

/* Reports to @pad and on the bus that a subframe was dropped. */
void
Demux::skip (GstCodedPad *pad, GstClockTime pts, GstClockTime duration)
{
  const auto running =
      gst_segment_to_running_time (&segment (), GST_FORMAT_TIME, pts);
  const auto stream_time =
      gst_segment_to_stream_time (&segment (), GST_FORMAT_TIME, pts);
  GstMessage *message = gst_message_new_qos (
      GST_OBJECT (element ()), is_live (), running, stream_time, pts, duration);
  locked (element (), [&] {
    shared_.counters.pictures_dropped++;
    gst_message_set_qos_values (
        message, pad->state.jitter, pad->state.proportion, 1000000);
    gst_message_set_qos_stats (message, GST_FORMAT_BUFFERS,
        shared_.counters.pictures_out, shared_.counters.pictures_dropped);
  });
  gst_element_post_message (element (), message);
  pad->state.discont = true;
  gst_pad_push_event (GST_PAD (pad), gst_event_new_gap (pts, duration));
}

bool
Demux::is_late (GstCodedPad *pad, GstClockTime pts, GstClockTime duration)
{
  if (!in_force_.qos)
    return false;
  const GstClockTime earliest =
      locked (element (), [&] { return pad->state.earliest; });
  const GstClockTime running = gst_segment_to_running_time (
      &segment (), GST_FORMAT_TIME, backwards () ? pts + duration : pts);
  return GST_CLOCK_TIME_IS_VALID (earliest) &&
         GST_CLOCK_TIME_IS_VALID (running) && running < earliest;
}

/* False if the pad is not linked: it gets no subframes, but its flow is
 * combined with that of the others. */
bool
Demux::prepare_pad (GstCodedPad *pad, guint at_once, GstFlowReturn &flow)
{
  if (is_wanted (GST_PAD (pad))) {
    prepare_allocation (pad, caps_for (pad).get (), at_once);
    return true;
  }
  flow = combine_flow (pad, GST_FLOW_NOT_LINKED);
  return false;
}

/* Finds the pads of each subframe of a part of @frame. Subframes outside of the
 * segment have none; late ones are dropped and reported. */
Demux::Targets
Demux::find_targets (const CodedFrame &frame, const PadMap &pads,
    const SplitPart &part, GstFlowReturn &flow)
{
  const auto n = std::size_t (part.subframes ());
  Targets targets (n);
  const auto aim = [&] (GstCodedPad *pad, std::size_t k, Nanoseconds duration,
                       GstCodedPad *&target) {
    const GstClockTime pts = frame.pts_of (int (k), int (n), format ().rate);
    if (!is_within (pts, GstClockTime (duration)))
      return;
    if (is_late (pad, pts, GstClockTime (duration)))
      skip (pad, pts, GstClockTime (duration));
    else
      target = pad;
  };

  GstCodedPad *all = part.region < 0
                         ? find_pad (pads, PadKind::all)
                         : find_pad (pads, PadKind::region, part.region);
  if (all && prepare_pad (all, guint (n), flow)) {
    for (std::size_t i = 0; i < n; i++) {
      const std::size_t k = backwards () ? n - 1 - i : i;
      aim (all, k, part.boundaries[k + 1] - part.boundaries[k], targets[k].all);
    }
  }
  if (part.region >= 0)
    return targets;
  for (std::size_t k = 0; k < n; k++) {
    GstCodedPad *one = find_pad (pads, PadKind::one, int (k));
    if (one && prepare_pad (one, 1, flow))
      aim (one, k, part.period (), targets[k].one);
  }
  return targets;
}

/* ---------------------------------------------------------------- pixels -- */

/* Memory for a subframe that no pad wants: the extractor writes all of them. */
template <typename Pixel>
ImageView<Pixel>
Demux::scratch_view (std::size_t part, std::size_t k)
{
  const GstVideoInfo &info = plan_->infos[part];
  const std::size_t row = std::size_t (info.width) * sizeof (Pixel);
  const std::size_t plane = row * std::size_t (info.height);
  const std::size_t size =
      plane * std::size_t (plan_->parts[part].subframes ());
  if (scratch_.size () < size)
    scratch_.resize (size);
  return {reinterpret_cast<Pixel *> (scratch_.data () + k * plane), info.width,
      info.height, std::ptrdiff_t (row)};
}

/* Acquires and maps a buffer for every subframe that has a pad; the others stay
 * unmapped. */
GstFlowReturn
Demux::map_subframes (
    std::size_t part, Targets &targets, std::vector<MappedFrame> &subframes)
{
  subframes.reserve (targets.size ());
  bool waited = false; // for a buffer of the pad that gets all
  for (Target &target : targets) {
    MappedFrame &mapped = subframes.emplace_back ();
    if (!target.owner ())
      continue;
    const bool first = !target.all || !std::exchange (waited, true);
    const GstFlowReturn flow = acquire_picture (
        target.owner (), plan_->infos[part], first, target.buffer, mapped);
    if (flow != GST_FLOW_OK)
      return flow;
  }
  return GST_FLOW_OK;
}

/* Fills the buffers of a part from @light, which has one pixel a mirror. */
template <typename Pixel>
GstFlowReturn
Demux::render_part (CodedFrame &frame, std::size_t part, Targets &targets,
    ImageView<const Pixel> light)
{
  std::vector<MappedFrame> subframes;
  const GstFlowReturn flow = map_subframes (part, targets, subframes);
  if (flow != GST_FLOW_OK)
    return flow;
  std::vector<ImageView<Pixel>> views;
  views.reserve (subframes.size ());
  for (std::size_t k = 0; k < subframes.size (); k++)
    views.push_back (subframes[k] ? view_of<Pixel> (subframes[k])
                                  : scratch_view<Pixel> (part, k));
  const auto &[x, y, width, height] = plan_->parts[part].rect;
  const auto &extractor =
      std::get<Extractor<Pixel>> (plan_->parts[part].extractor);
  const auto report = extractor.run (light.block (x, y, width, height), views);
  if (!report)
    return post_decode_error (report.error ());
  frame.meta.saturated = report->saturated;
  return GST_FLOW_OK;
}

/* Fills the buffers of all parts. */
template <typename Pixel>
GstFlowReturn
Demux::render (CodedFrame &frame, std::vector<Targets> &parts)
{
  MappedFrame coded = map_coded (frame.buffer.get ());
  if (!coded)
    return GST_FLOW_ERROR;
  const auto light = light_of (view_of<const Pixel> (coded));
  if (!light)
    return post_decode_error (light.error ());
  GstFlowReturn flow = GST_FLOW_OK;
  for (std::size_t i = 0; i < parts.size (); i++)
    if (any_wanted (parts[i]) && flow == GST_FLOW_OK)
      flow = render_part (frame, i, parts[i], *light);
  /* Each extractor counts the cells of its own part. */
  if (parts.size () > 1)
    frame.meta.saturated = count_saturated (
        light->rows (0, light->height - format ().schedule.pilot_rows ()),
        significant_bits ());
  return flow;
}

/* --------------------------------------------------------------- pushing -- */

/* @outbuf for the second pad, @pad: the same memory, or a copy of the pixels if
 * the pad's peer cannot read their layout. */
BufferPtr
Demux::share (
    const GstVideoInfo &info, const GstCodedPad *pad, GstBuffer *outbuf)
{
  const GstVideoMeta *layout = gst_buffer_get_video_meta (outbuf);
  const bool plain = !layout || (layout->offset[0] == info.offset[0] &&
                                    layout->stride[0] == info.stride[0]);
  if (plain || pad->state.allocation->video_meta)
    return BufferPtr (gst_buffer_copy (outbuf));

  BufferPtr packed (
      gst_buffer_new_allocate (nullptr, GST_VIDEO_INFO_SIZE (&info), nullptr));
  copy_description (outbuf, info, packed.get ());
  MappedFrame from (info, outbuf, GST_MAP_READ);
  MappedFrame to (info, packed.get (), GST_MAP_WRITE);
  if (from && to)
    gst_video_frame_copy (to.frame (), from.frame ());
  return packed;
}

GstFlowReturn
Demux::push_subframe (const CodedFrame &frame, SplitTurn turn, Target target)
{
  const SplitPart &part = plan_->parts[turn.part];
  const GstVideoInfo &info = plan_->infos[turn.part];
  const std::size_t k = turn.subframe;
  const GstClockTime start = frame.pts ();
  const LightWindow &light = part.windows[k];
  describe (target.buffer.get (), frame.buffer.get (), frame.meta,
      {info, int (k), frame.pts_of (int (k), part.subframes (), format ().rate),
          start + GstClockTime (light.start), GstClockTime (light.duration),
          part.region >= 0});
  BufferPtr second;
  if (target.all && target.one)
    second = share (info, target.one, target.buffer.get ());

  GstFlowReturn flow = GST_FLOW_OK;
  if (target.all)
    flow = combine_flow (target.all,
        push (target.all, std::move (target.buffer),
            GstClockTime (part.boundaries[k + 1] - part.boundaries[k])));
  else
    second = std::move (target.buffer);
  if (target.one && !is_fatal (flow))
    flow = combine_flow (target.one,
        push (target.one, std::move (second), GstClockTime (part.period ())));
  return flow;
}

} // namespace codedexposure::gst::demux

struct GstCodedExposureDemux : Instance<GstCodedFilter, demux::Demux> {
};
GST_ELEMENT_REGISTER_DEFINE (codedexposure_demux, "codedexposure-demux",
    GST_RANK_NONE,
    (type_of<GstCodedExposureDemux, demux::Demux::set_up_class> (
        "GstCodedExposureDemux", coded_filter_type ())))

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
 *   camera's rate times the region's own n; of a schedule without regions there
 *   are none.
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
 * The period comes from the caps, or from #codedexposure-demux:frame-rate
 * where they have none; a lost frame never stretches its neighbours.
 *
 * ## Schedule
 *
 * Which pixel saw which part of the exposure is told by the schedule: by the
 * #codedexposure-demux:schedule property, else by the stream's tag
 * `comment=coded-exposure={...}`, else sequential:2x2 is assumed and a warning
 * on the bus says so. Caps of source pads are fixed with the first frame,
 * because tags come after caps. Width and height are divided by the cell of the
 * tile, pixel-aspect-ratio follows; columns and rows that fill no cell, and the
 * pilot's rows, are cropped.
 *
 * Where the schedule has regions, areas with a tile and a code of their own,
 * `src` and `subframe_<k>` show the background, which has the tile and the code
 * of the schedule: their size and rate are its, and what a region touches is
 * black. A region's subframes have its own size, rate and times. Pads are
 * served in the order of time. All parts are brought to the same brightness;
 * #codedexposure-demux:method=select by name keeps the camera's values.
 *
 * ## Mapping
 *
 * A camera that is not quite aligned with the mirrors is put right by a
 * mapping: by the #codedexposure-demux:mapping property, else by the stream's
 * tag. Frames are rectified to one pixel a mirror before they are taken apart;
 * regions are places among the mirrors, wherever the camera sees them. The
 * element message `codedexposure/mapping` says how well it sees them.
 *
 * ## Flags, metas and messages
 *
 * A gap of more than one and a half periods between two frames is a loss: it is
 * counted, the next subframe of every pad is DISCONT, and the element message
 * `codedexposure/frames-lost` says `count`, `from` (when the first was due) and
 * `to` (the frame that came). CORRUPTED and GAP pass to all subframes of a
 * frame. `codedexposure/saturated` says when a stretch of frames with pixels at
 * the largest value begins (`active` true), and when there were none for a
 * second.
 *
 * Every subframe bears the custom meta `CodedExposureFrame` with the number of
 * its frame, its index and the time of its light; other metas of the frame are
 * copied.
 *
 * ## Latency and quality of service
 *
 * The element adds no latency: it holds no frame back, and subframe k is due
 * only k slots after its frame. Nothing is dropped unless
 * #codedexposure-demux:qos is set, and then only what a sink would drop, with a
 * QoS message each. QoS events go no further upstream: some camera sources
 * stop their stream for them.
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
#include "gstcodedexposuredemux.h"

#include "gstcodedexposuredemuxstate.h"

GST_DEBUG_CATEGORY (codedexposure_demux_debug);
#define GST_CAT_DEFAULT codedexposure_demux_debug

using namespace cexp;
using namespace cexp::gst;
using demux::Counters;
using demux::DemuxState;
using demux::Output;

struct _GstCodedExposureDemux {
  GstElement parent;
  DemuxState *state;
};

G_DEFINE_TYPE_WITH_CODE (GstCodedExposureDemux, gst_coded_exposure_demux,
    GST_TYPE_ELEMENT,
    GST_DEBUG_CATEGORY_INIT (codedexposure_demux_debug, "codedexposure-demux",
        0, "coded frames to subframes"))
GST_ELEMENT_REGISTER_DEFINE (codedexposure_demux, "codedexposure-demux",
    GST_RANK_NONE, GST_TYPE_CODED_EXPOSURE_DEMUX)

namespace
{

GstStaticPadTemplate sink_template = GST_STATIC_PAD_TEMPLATE ("sink",
    GST_PAD_SINK, GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate src_template = GST_STATIC_PAD_TEMPLATE ("src", GST_PAD_SRC,
    GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate subframe_template = GST_STATIC_PAD_TEMPLATE ("subframe_%u",
    GST_PAD_SRC, GST_PAD_REQUEST, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate region_template = GST_STATIC_PAD_TEMPLATE ("region_%u",
    GST_PAD_SRC, GST_PAD_REQUEST, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate coded_template = GST_STATIC_PAD_TEMPLATE ("coded",
    GST_PAD_SRC, GST_PAD_REQUEST, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));

void
forget_stream (GstCodedExposureDemux *self)
{
  DemuxState &st = *self->state;
  st.stream = demux::Stream ();
  const auto list = demux::outputs (self);
  list->each ([] (const demux::OutputRef &output) {
    output->discont = true;
    output->offset = 0;
    output->allocation.reset ();
  });
  const ObjectLock lock (self);
  st.settings_changed = true;
  st.caps = demux::PadCaps ();
  st.in_force.reset ();
  st.assumed = false;
  st.rectifies = false;
  st.method = Method::kAuto;
  st.ended = false;
  gst_flow_combiner_reset (st.combiner.get ());
  list->each ([] (const demux::OutputRef &output) {
    output->earliest = GST_CLOCK_TIME_NONE;
  });
}

GstStateChangeReturn
change_state (GstElement *element, GstStateChange transition) noexcept
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (element);
  if (transition == GST_STATE_CHANGE_NULL_TO_READY &&
      !read_again (element, self->state->settings))
    return GST_STATE_CHANGE_FAILURE;
  /* The counters of a run can be read until the next one begins. */
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED) {
    const ObjectLock lock (self);
    self->state->counters = Counters ();
  }

  const GstStateChangeReturn changed =
      GST_ELEMENT_CLASS (gst_coded_exposure_demux_parent_class)
          ->change_state (element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY)
    forget_stream (self);
  return changed;
}

void
finalize (GObject *object) noexcept
{
  delete GST_CODED_EXPOSURE_DEMUX (object)->state;
  G_OBJECT_CLASS (gst_coded_exposure_demux_parent_class)->finalize (object);
}

} // namespace

static void
gst_coded_exposure_demux_class_init (GstCodedExposureDemuxClass *klass)
{
  auto *object = G_OBJECT_CLASS (klass);
  object->finalize = GST_DEBUG_FUNCPTR (finalize);
  demux::install_properties (object);

  auto *element = GST_ELEMENT_CLASS (klass);
  element->change_state = GST_DEBUG_FUNCPTR (change_state);
  element->request_new_pad = GST_DEBUG_FUNCPTR (demux::request_pad);
  element->release_pad = GST_DEBUG_FUNCPTR (demux::release_pad);
  for (auto *pad_template : {&sink_template, &src_template, &subframe_template,
           &region_template, &coded_template})
    gst_element_class_add_static_pad_template (element, pad_template);
  gst_element_class_set_static_metadata (element,
      "Coded exposure demultiplexer", "Filter/Effect/Video",
      "Splits the frames of a camera behind a micromirror device into "
      "subframes at a multiple of the frame rate",
      "The gst-codedexposure authors");
}

static void
gst_coded_exposure_demux_init (GstCodedExposureDemux *self)
{
  self->state = new DemuxState;
  GstPad *sink = gst_pad_new_from_static_template (&sink_template, "sink");
  self->state->sinkpad = sink;
  gst_pad_set_chain_function (sink, GST_DEBUG_FUNCPTR (demux::chain));
  gst_pad_set_event_function (sink, GST_DEBUG_FUNCPTR (demux::sink_event));
  gst_pad_set_query_function (sink, GST_DEBUG_FUNCPTR (demux::sink_query));
  /* Caps without a frame rate are no subset of the template; what a rate is
   * needed for is said at the first frame. */
  GST_PAD_SET_ACCEPT_INTERSECT (sink);
  GST_PAD_SET_ACCEPT_TEMPLATE (sink);
  gst_element_add_pad (GST_ELEMENT (self), sink);
  demux::add_output (self,
      gst_element_class_get_pad_template (GST_ELEMENT_GET_CLASS (self), "src"),
      Output::Kind::kAll, -1);
}

namespace cexp::gst::demux
{

DemuxState &
state (GstCodedExposureDemux *self)
{
  return *self->state;
}

std::shared_ptr<const Outputs>
outputs (GstCodedExposureDemux *self)
{
  const ObjectLock lock (self);
  return self->state->outputs;
}

void
notify (GstCodedExposureDemux *self, const char *property)
{
  g_object_notify (G_OBJECT (self), property);
}

} // namespace cexp::gst::demux

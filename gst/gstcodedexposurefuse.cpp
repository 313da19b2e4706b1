/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-fuse
 * @title: codedexposure-fuse
 * @short_description: Full-resolution frames at N times the camera's rate
 *
 * Takes the frames of a camera behind a micromirror device, in which
 * neighbouring pixels saw different parts of the exposure, and gives n frames
 * for each: at n times the rate, and of the size of the coded frame. Where the
 * picture stands still it keeps the resolution of the whole coded frame; where
 * it moves, it follows the slots.
 *
 * codedexposure-demux gives what was measured, in n small pictures; this
 * element estimates what lies between.
 *
 * ## Time
 *
 * Frame k of a coded frame at time P, of a camera with frame period T, has PTS
 * P + floor (k T / n) and lasts until the next one; OFFSET counts frames. The
 * period comes from the caps, or from #codedexposure-fuse:frame-rate where they
 * have none. A lost frame never stretches its neighbours.
 *
 * Without #codedexposure-fuse:lookahead a coded frame is fused as soon as it
 * comes and nothing is added to the latency. With it, a coded frame waits for
 * the next one, and T is added to the latency.
 *
 * What was seen before helps to tell what stands still. A lost, corrupted or
 * late frame, a DISCONT, a seek and a new segment start that history anew.
 *
 * ## Schedule
 *
 * Which pixel saw which part of the exposure is told by the schedule: by the
 * #codedexposure-fuse:schedule property, else by the stream's tag
 * `comment=coded-exposure={...}`, else sequential:2x2 is assumed and a warning
 * on the bus says so. Caps of the source pad are fixed with the first frame,
 * because tags come after caps. The pilot's rows are cropped. Every code and
 * tile will do; `sequential:lattice:4/2` and
 * `sequential:lattice:8/3,order=bit-reversal` give the truest pictures.
 *
 * ## Mapping
 *
 * A camera that is not quite aligned with the mirrors is put right by a
 * mapping: by the #codedexposure-fuse:mapping property, else by the stream's
 * tag. Frames are rectified to one pixel a mirror before they are fused, and
 * fused frames have the size of the mirrors; regions are places among them. The
 * element message `codedexposure/mapping` says how well the camera sees the
 * mirrors.
 *
 * ## Quality and speed
 *
 * `quality=fast` runs in real time: 768x576 from 25 to 100 frames/s take less
 * than half of a core of a fast processor. `balanced` and `best` look for the
 * motion around each pixel, take a hundred times as long, and are for decoding
 * of recordings; #codedexposure-fuse:threads share their work.
 * Tell the element about the camera's noise (#codedexposure-fuse:full-well,
 * #codedexposure-fuse:read-noise): it filters more where the noise is larger,
 * and knows what it may take for still.
 *
 * ## Flags, metas and messages
 *
 * A gap of more than one and a half periods between two frames is a loss: it is
 * counted, the next frame is DISCONT, and the element message
 * `codedexposure/frames-lost` says `count`, `from` (when the first was due) and
 * `to` (the frame that came). CORRUPTED and GAP pass to all frames of a coded
 * frame. `codedexposure/saturated` says when a stretch of frames with pixels at
 * the largest value begins (`active` true), and when there were none for a
 * second. Every frame bears the custom meta `CodedExposureFrame` with the
 * number of its coded frame, its slot and the time of its light; other metas of
 * the coded frame are copied. QoS events go no further upstream: some camera
 * sources stop their stream for them.
 *
 * ## Example pipelines
 *
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim schedule=sequential:lattice:4/2 full-well=10000 \
 *     ! codedexposure-fuse full-well=10000 \
 *     ! queue ! videoconvert ! autovideosink
 * ]| A simulated bench, shown at full resolution and the raised rate.
 *
 * Since: 0.1
 */
#include "gstcodedexposurefuse.h"

#include "gstcodedexposurefusestate.h"

GST_DEBUG_CATEGORY (codedexposure_fuse_debug);
#define GST_CAT_DEFAULT codedexposure_fuse_debug

using namespace cexp;
using namespace cexp::gst;

struct _GstCodedExposureFuse {
  GstElement parent;
  cexp::gst::fuse::FuseState *state;
};

G_DEFINE_TYPE_WITH_CODE (GstCodedExposureFuse, gst_coded_exposure_fuse,
    GST_TYPE_ELEMENT,
    GST_DEBUG_CATEGORY_INIT (codedexposure_fuse_debug, "codedexposure-fuse", 0,
        "coded frames to full-resolution frames"))
GST_ELEMENT_REGISTER_DEFINE (codedexposure_fuse, "codedexposure-fuse",
    GST_RANK_NONE, GST_TYPE_CODED_EXPOSURE_FUSE)

namespace
{

GstStaticPadTemplate sink_template = GST_STATIC_PAD_TEMPLATE ("sink",
    GST_PAD_SINK, GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate src_template = GST_STATIC_PAD_TEMPLATE ("src", GST_PAD_SRC,
    GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));

void
forget_stream (GstCodedExposureFuse *self)
{
  cexp::gst::fuse::FuseState &st = *self->state;
  st.stream = cexp::gst::fuse::Stream ();
  const ObjectLock lock (self);
  st.settings_changed = true;
  st.in_force.reset ();
  st.assumed = false;
  st.rectifies = false;
  st.latency = 0;
}

GstStateChangeReturn
change_state (GstElement *element, GstStateChange transition) noexcept
{
  auto *self = GST_CODED_EXPOSURE_FUSE (element);
  if (transition == GST_STATE_CHANGE_NULL_TO_READY &&
      !read_again (element, self->state->settings))
    return GST_STATE_CHANGE_FAILURE;
  /* The counters of a run can be read until the next one begins. */
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED) {
    const ObjectLock lock (self);
    self->state->counters = cexp::gst::fuse::Counters ();
    self->state->hurry = std::stop_source ();
  }
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY)
    cexp::gst::fuse::hurry (self);

  const GstStateChangeReturn changed =
      GST_ELEMENT_CLASS (gst_coded_exposure_fuse_parent_class)
          ->change_state (element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY)
    forget_stream (self);
  return changed;
}

void
finalize (GObject *object) noexcept
{
  delete GST_CODED_EXPOSURE_FUSE (object)->state;
  G_OBJECT_CLASS (gst_coded_exposure_fuse_parent_class)->finalize (object);
}

} // namespace

static void
gst_coded_exposure_fuse_class_init (GstCodedExposureFuseClass *klass)
{
  auto *object = G_OBJECT_CLASS (klass);
  object->finalize = GST_DEBUG_FUNCPTR (finalize);
  cexp::gst::fuse::install_properties (object);

  auto *element = GST_ELEMENT_CLASS (klass);
  element->change_state = GST_DEBUG_FUNCPTR (change_state);
  gst_element_class_add_static_pad_template (element, &sink_template);
  gst_element_class_add_static_pad_template (element, &src_template);
  gst_element_class_set_static_metadata (element, "Coded exposure fusion",
      "Filter/Effect/Video",
      "Reconstructs full-resolution frames at a multiple of the frame rate "
      "from the frames of a camera behind a micromirror device",
      "The gst-codedexposure authors");
}

static void
gst_coded_exposure_fuse_init (GstCodedExposureFuse *self)
{
  namespace fuse = cexp::gst::fuse;
  self->state = new fuse::FuseState;
  GstPad *sink = gst_pad_new_from_static_template (&sink_template, "sink");
  self->state->sinkpad = sink;
  gst_pad_set_chain_function (sink, GST_DEBUG_FUNCPTR (fuse::chain));
  gst_pad_set_event_function (sink, GST_DEBUG_FUNCPTR (fuse::sink_event));
  gst_pad_set_query_function (sink, GST_DEBUG_FUNCPTR (fuse::sink_query));
  /* Caps without a frame rate are no subset of the template; what a rate is
   * needed for is said at the first frame. */
  GST_PAD_SET_ACCEPT_INTERSECT (sink);
  GST_PAD_SET_ACCEPT_TEMPLATE (sink);
  gst_element_add_pad (GST_ELEMENT (self), sink);

  GstPad *src = gst_pad_new_from_static_template (&src_template, "src");
  self->state->srcpad = src;
  gst_pad_set_event_function (src, GST_DEBUG_FUNCPTR (fuse::src_event));
  gst_pad_set_query_function (src, GST_DEBUG_FUNCPTR (fuse::src_query));
  gst_element_add_pad (GST_ELEMENT (self), src);
}

namespace cexp::gst::fuse
{

FuseState &
state (GstCodedExposureFuse *self)
{
  return *self->state;
}

void
hurry (GstCodedExposureFuse *self)
{
  const ObjectLock lock (self);
  state (self).hurry.request_stop ();
}

void
take_time (GstCodedExposureFuse *self)
{
  const ObjectLock lock (self);
  state (self).hurry = std::stop_source ();
}

void
notify (GstCodedExposureFuse *self, const char *property)
{
  g_object_notify (G_OBJECT (self), property);
}

} // namespace cexp::gst::fuse

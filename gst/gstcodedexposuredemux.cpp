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
 * ## Flags, metas and messages
 *
 * A gap of more than one and a half periods between two frames is a loss: it is
 * counted, the next subframe of every pad is DISCONT, and the element message
 * `codedexposure/frames-lost` says `count`, `from` (when the first was due) and
 * `to` (the frame that came). CORRUPTED and GAP pass to all subframes of a
 * frame. `codedexposure/saturated` says when a stretch of frames with pixels at
 * the largest value begins (`active` true) and ends.
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
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball !
 * video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 !
 * codedexposure-sim schedule=staircase:2x2 ! codedexposure-demux ! queue !
 * videoconvert ! autovideosink
 * ]| A simulated bench, shown at the raised rate.
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball !
 * video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 !
 * codedexposure-sim ! codedexposure-demux name=demux demux.src ! queue !
 * videoconvert ! autovideosink demux.coded ! queue ! avenc_ffv1 ! matroskamux !
 * filesink location=coded.mkv
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

enum {
  PROP_0,
  PROP_SCHEDULE,
  PROP_METHOD,
  PROP_GAIN,
  PROP_BITS,
  PROP_INTERPOLATE,
  PROP_FRAME_RATE,
  PROP_QOS,
  PROP_FRAMES_IN,
  PROP_SUBFRAMES_OUT,
  PROP_FRAMES_LOST,
  PROP_FRAMES_CORRUPTED,
  PROP_SUBFRAMES_DROPPED,
  PROP_SATURATED_FRAMES,
  PROP_SCHEDULE_IN_FORCE,
  PROP_METHOD_IN_FORCE,
  PROP_STATS,
};

#define DEFAULT_SCHEDULE ""
#define DEFAULT_METHOD int (Method::kAuto)
#define DEFAULT_GAIN 0.0
#define DEFAULT_BITS 0
#define DEFAULT_INTERPOLATE TRUE
#define DEFAULT_QOS FALSE

constexpr auto kReadWrite = GParamFlags (
    G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_PLAYING);
constexpr auto kReadOnly =
    GParamFlags (G_PARAM_READABLE | G_PARAM_STATIC_STRINGS);

GstStaticPadTemplate sink_template = GST_STATIC_PAD_TEMPLATE ("sink",
    GST_PAD_SINK, GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate src_template = GST_STATIC_PAD_TEMPLATE ("src", GST_PAD_SRC,
    GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate subframe_template = GST_STATIC_PAD_TEMPLATE ("subframe_%u",
    GST_PAD_SRC, GST_PAD_REQUEST, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate coded_template = GST_STATIC_PAD_TEMPLATE ("coded",
    GST_PAD_SRC, GST_PAD_REQUEST, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));

#define GST_TYPE_CODED_EXPOSURE_METHOD (coded_exposure_method_get_type ())
GType
coded_exposure_method_get_type ()
{
  static const GEnumValue values[] = {
      {int (Method::kAuto),
          "select for one-hot codes, decode for other codes that can be "
          "inverted, else rank",
          "auto"},
      {int (Method::kRank),
          "subframe k is the k-th smallest pixel of each group", "rank"},
      {int (Method::kSelect),
          "subframe k is the element that is open in slot k", "select"},
      {int (Method::kDecode), "solves the code for the light of each slot",
          "decode"},
      {0, nullptr, nullptr},
  };
  static gsize type = 0;
  if (g_once_init_enter (&type)) {
    const GType made =
        g_enum_register_static ("GstCodedExposureMethod", values);
    g_once_init_leave (&type, made);
  }
  return type;
}

void
set_schedule (GstCodedExposureDemux *self, const gchar *text)
{
  demux::Settings &settings = self->state->settings;
  std::string schedule = text ? text : "";
  std::shared_ptr<const Result<Schedule>> parsed;
  if (!schedule.empty ()) {
    parsed =
        std::make_shared<const Result<Schedule>> (Schedule::parse (schedule));
    if (!*parsed)
      GST_WARNING_OBJECT (self, "%s", parsed->error ().message.c_str ());
  }
  const ObjectLock lock (self);
  settings.schedule = std::move (schedule);
  settings.parsed = std::move (parsed);
}

void
set_property (GObject *object, guint id, const GValue *value, GParamSpec *pspec)
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (object);
  if (id == PROP_SCHEDULE)
    set_schedule (self, g_value_get_string (value));

  const ObjectLock lock (self);
  demux::Settings &settings = self->state->settings;
  self->state->settings_changed = true;
  switch (id) {
  case PROP_SCHEDULE:
    break;
  case PROP_METHOD:
    settings.extract.method = Method (g_value_get_enum (value));
    break;
  case PROP_GAIN:
    settings.extract.gain = g_value_get_double (value);
    break;
  case PROP_BITS:
    settings.extract.bits = g_value_get_int (value);
    break;
  case PROP_INTERPOLATE:
    settings.extract.interpolate = g_value_get_boolean (value);
    break;
  case PROP_FRAME_RATE:
    settings.rate_num = gst_value_get_fraction_numerator (value);
    settings.rate_den = gst_value_get_fraction_denominator (value);
    break;
  case PROP_QOS:
    settings.qos = g_value_get_boolean (value);
    break;
  default:
    G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
  }
}

GstStructure *
stats (const Counters &counters)
{
  return gst_structure_new ("application/x-codedexposure-demux-stats",
      "frames-in", G_TYPE_UINT64, counters.frames_in, "subframes-out",
      G_TYPE_UINT64, counters.subframes_out, "frames-lost", G_TYPE_UINT64,
      counters.frames_lost, "frames-corrupted", G_TYPE_UINT64,
      counters.frames_corrupted, "subframes-dropped", G_TYPE_UINT64,
      counters.subframes_dropped, "saturated-frames", G_TYPE_UINT64,
      counters.saturated_frames, nullptr);
}

/* Everything that the streaming thread writes. Returns false for a property
 * that is a setting. */
bool
get_report (const DemuxState &st, guint id, GValue *value)
{
  switch (id) {
  case PROP_FRAMES_IN:
    g_value_set_uint64 (value, st.counters.frames_in);
    return true;
  case PROP_SUBFRAMES_OUT:
    g_value_set_uint64 (value, st.counters.subframes_out);
    return true;
  case PROP_FRAMES_LOST:
    g_value_set_uint64 (value, st.counters.frames_lost);
    return true;
  case PROP_FRAMES_CORRUPTED:
    g_value_set_uint64 (value, st.counters.frames_corrupted);
    return true;
  case PROP_SUBFRAMES_DROPPED:
    g_value_set_uint64 (value, st.counters.subframes_dropped);
    return true;
  case PROP_SATURATED_FRAMES:
    g_value_set_uint64 (value, st.counters.saturated_frames);
    return true;
  case PROP_SCHEDULE_IN_FORCE:
    g_value_set_string (
        value, st.in_force ? st.in_force->text ().c_str () : "");
    return true;
  case PROP_METHOD_IN_FORCE:
    g_value_set_enum (value, int (st.method));
    return true;
  case PROP_STATS:
    g_value_take_boxed (value, stats (st.counters));
    return true;
  default:
    return false;
  }
}

void
get_property (GObject *object, guint id, GValue *value, GParamSpec *pspec)
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (object);
  const ObjectLock lock (self);
  const demux::Settings &settings = self->state->settings;
  switch (id) {
  case PROP_SCHEDULE:
    g_value_set_string (value, settings.schedule.c_str ());
    break;
  case PROP_METHOD:
    g_value_set_enum (value, int (settings.extract.method));
    break;
  case PROP_GAIN:
    g_value_set_double (value, settings.extract.gain);
    break;
  case PROP_BITS:
    g_value_set_int (value, settings.extract.bits);
    break;
  case PROP_INTERPOLATE:
    g_value_set_boolean (value, settings.extract.interpolate);
    break;
  case PROP_FRAME_RATE:
    gst_value_set_fraction (value, settings.rate_num, settings.rate_den);
    break;
  case PROP_QOS:
    g_value_set_boolean (value, settings.qos);
    break;
  default:
    if (!get_report (*self->state, id, value))
      G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
  }
}

/* A file may have changed since the property was set, and a schedule that
 * cannot be read should be known before anything runs. */
bool
read_schedule_again (GstCodedExposureDemux *self)
{
  std::string text;
  {
    const ObjectLock lock (self);
    text = self->state->settings.schedule;
  }
  set_schedule (self, text.c_str ());
  std::shared_ptr<const Result<Schedule>> parsed;
  {
    const ObjectLock lock (self);
    parsed = self->state->settings.parsed;
  }
  if (!parsed || *parsed)
    return true;
  GST_ELEMENT_ERROR (self, RESOURCE, SETTINGS,
      ("The schedule property cannot be read: %s",
          parsed->error ().message.c_str ()),
      (nullptr));
  return false;
}

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
  st.method = Method::kAuto;
  st.ended = false;
  gst_flow_combiner_reset (st.combiner.get ());
  list->each ([] (const demux::OutputRef &output) {
    output->earliest = GST_CLOCK_TIME_NONE;
  });
}

GstStateChangeReturn
change_state (GstElement *element, GstStateChange transition)
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (element);
  if (transition == GST_STATE_CHANGE_NULL_TO_READY &&
      !read_schedule_again (self))
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
finalize (GObject *object)
{
  delete GST_CODED_EXPOSURE_DEMUX (object)->state;
  G_OBJECT_CLASS (gst_coded_exposure_demux_parent_class)->finalize (object);
}

void
install_settings (GObjectClass *klass)
{
  /**
   * codedexposure-demux:schedule:
   *
   * Tile, code and timing of the exposure. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_SCHEDULE,
      g_param_spec_string ("schedule", "Schedule",
          "Schedule of the coded exposure: a preset such as "
          "\"sequential:2x2\" or \"staircase:2x2,active=9.8ms\", or the path "
          "of a JSON file; empty: what the stream's tag says, else "
          "sequential:2x2",
          DEFAULT_SCHEDULE, kReadWrite));
  /**
   * codedexposure-demux:method:
   *
   * How subframes are found in a coded frame. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_METHOD,
      g_param_spec_enum ("method", "Method",
          "How subframes are found in a coded frame",
          GST_TYPE_CODED_EXPOSURE_METHOD, DEFAULT_METHOD, kReadWrite));
  /**
   * codedexposure-demux:gain:
   *
   * Factor on the light of a slot, with method decode. Applied at the next
   * frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_GAIN,
      g_param_spec_double ("gain", "Gain",
          "Factor on the light of a slot (method decode); 0: white in a slot "
          "is white out",
          0.0, G_MAXDOUBLE, DEFAULT_GAIN, kReadWrite));
  /**
   * codedexposure-demux:bits:
   *
   * Significant bits, for pixels that fill only a part of GRAY16_LE.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_BITS,
      g_param_spec_int ("bits", "Bits",
          "Significant bits of a pixel, counted from the lowest, for example "
          "12 for a 12-bit camera in GRAY16_LE; saturation is judged by it; "
          "0: all bits of the format",
          0, 16, DEFAULT_BITS, kReadWrite));
  /**
   * codedexposure-demux:interpolate:
   *
   * Whether the elements are brought to one place before the code is solved.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_INTERPOLATE,
      g_param_spec_boolean ("interpolate", "Interpolate",
          "Interpolate the elements to the centre of their cell before the "
          "code is solved (method decode on raster tiles)",
          DEFAULT_INTERPOLATE, kReadWrite));
  /**
   * codedexposure-demux:frame-rate:
   *
   * Rate of the coded frames, where their caps do not say it.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_FRAME_RATE,
      gst_param_spec_fraction ("frame-rate", "Frame rate",
          "Rate of the coded frames in 1/s, used where their caps have no "
          "framerate or 0/1; 0/1: only from the caps",
          0, 1, G_MAXINT, 1, 0, 1, kReadWrite));
  /**
   * codedexposure-demux:qos:
   *
   * Whether subframes that come too late for their sink are left out.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_QOS,
      g_param_spec_boolean ("qos", "QoS",
          "Leave out subframes that would reach their sink too late, and post "
          "a QoS message for each; off: nothing is ever dropped",
          DEFAULT_QOS, kReadWrite));
}

void
install_counter (GObjectClass *klass, guint id, const char *name,
    const char *nick, const char *blurb)
{
  g_object_class_install_property (klass, id,
      g_param_spec_uint64 (name, nick, blurb, 0, G_MAXUINT64, 0, kReadOnly));
}

/* Counters that run with the frames do not notify; those of events do. */
void
install_reports (GObjectClass *klass)
{
  install_counter (klass, PROP_FRAMES_IN, "frames-in", "Frames in",
      "Coded frames that came in since the stream started");
  install_counter (klass, PROP_SUBFRAMES_OUT, "subframes-out", "Subframes out",
      "Subframes that were taken downstream, counted on every pad");
  install_counter (klass, PROP_FRAMES_LOST, "frames-lost", "Frames lost",
      "Coded frames that never came, by the gaps between time stamps; "
      "notifies");
  install_counter (klass, PROP_FRAMES_CORRUPTED, "frames-corrupted",
      "Frames corrupted",
      "Coded frames that upstream flagged as corrupted; notifies");
  install_counter (klass, PROP_SUBFRAMES_DROPPED, "subframes-dropped",
      "Subframes dropped",
      "Subframes that were left out because they were late (qos=true), "
      "counted on every pad");
  install_counter (klass, PROP_SATURATED_FRAMES, "saturated-frames",
      "Saturated frames",
      "Coded frames with a pixel at the largest value; notifies when a "
      "stretch of them begins or ends");
  /**
   * codedexposure-demux:schedule-in-force:
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_SCHEDULE_IN_FORCE,
      g_param_spec_string ("schedule-in-force", "Schedule in force",
          "The schedule that frames are split by, from the property, the tag "
          "or by default; empty before the first frame; notifies",
          "", kReadOnly));
  /**
   * codedexposure-demux:method-in-force:
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_METHOD_IN_FORCE,
      g_param_spec_enum ("method-in-force", "Method in force",
          "The method that frames are split by; auto before the first frame; "
          "notifies",
          GST_TYPE_CODED_EXPOSURE_METHOD, DEFAULT_METHOD, kReadOnly));
  /**
   * codedexposure-demux:stats:
   *
   * All counters at one moment, as `application/x-codedexposure-demux-stats`
   * with a guint64 for each counter property, under its name.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_STATS,
      g_param_spec_boxed ("stats", "Statistics", "All counters at one moment",
          GST_TYPE_STRUCTURE, kReadOnly));
}

} // namespace

static void
gst_coded_exposure_demux_class_init (GstCodedExposureDemuxClass *klass)
{
  auto *object = G_OBJECT_CLASS (klass);
  object->set_property = GST_DEBUG_FUNCPTR (set_property);
  object->get_property = GST_DEBUG_FUNCPTR (get_property);
  object->finalize = GST_DEBUG_FUNCPTR (finalize);
  install_settings (object);
  install_reports (object);
  gst_type_mark_as_plugin_api (
      GST_TYPE_CODED_EXPOSURE_METHOD, GstPluginAPIFlags (0));

  auto *element = GST_ELEMENT_CLASS (klass);
  element->change_state = GST_DEBUG_FUNCPTR (change_state);
  element->request_new_pad = GST_DEBUG_FUNCPTR (demux::request_pad);
  element->release_pad = GST_DEBUG_FUNCPTR (demux::release_pad);
  for (auto *pad_template :
      {&sink_template, &src_template, &subframe_template, &coded_template})
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

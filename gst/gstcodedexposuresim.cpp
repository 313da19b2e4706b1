/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-sim
 * @title: codedexposure-sim
 * @short_description: An optical bench in software
 *
 * Plays a camera behind a micromirror device: shows the input to mirrors that
 * step through the masks of a schedule, and gives what a slow camera would see
 * of it, coded frames. With it everything runs that runs on a bench, and the
 * truth is known.
 *
 * ## Rates
 *
 * A coded frame with N slots takes N m input frames, m a whole number: 100
 * frames/s and 4 slots make 25 coded frames/s, 200 frames/s make 50, or 25
 * where a caps filter behind the element asks for them. The largest rate that
 * downstream takes is chosen.
 *
 * |[
 *   input, m = 2   |0  |1  |2  |3  |4  |5  |6  |7  |8 ...
 *   slots          |0      |1      |2      |3      |0 ...
 *   coded frame    |PTS of input frame 0           |PTS of 8
 * ]|
 *
 * An input frame is constant light from its time until that of the next one,
 * as much in each pixel as its value says.
 * Slots lie in the frame as the schedule's timing says (`active`, `switching`,
 * `readout`) and collect what falls into their active time; while mirrors
 * switch and while the camera reads out, light is lost.
 *
 * ## Optics
 *
 * Pixel p of the camera looks at mirror c + shift + R (p - c) / scale, where c
 * is the centre of the picture and R turns by #codedexposure-sim:rotation from
 * x to y, clockwise on the screen. The scene lies on the mirrors one pixel to
 * one mirror; beyond it there is no light. Between mirrors and pixels, which
 * are squares without gaps, light is blurred by a Gaussian of
 * #codedexposure-sim:psf-sigma.
 *
 * ## Sensor
 *
 * White through all slots makes #codedexposure-sim:full-well electrons; a pixel
 * that is open in one slot of four gets a quarter of them, and as much less
 * signal to noise. Noise depends on #codedexposure-sim:seed, the frame's number
 * and the pixel, and on nothing else: the same seed gives the same bytes. With
 * #codedexposure-sim:gain at 0, white makes white for pixels that are open
 * longest, whatever code, leak and timing are. With no noise, no blur and no
 * misalignment, a `sequential` code gives each pixel its input's value exactly.
 *
 * ## DMD
 *
 * With #codedexposure-sim:dmd the masks are those of a simulated DMD that a
 * dmdsync with the same device drives, and its schedule is in force; before
 * somebody starts the mirrors, coded frames are dark. Else the masks step with
 * the frames.
 *
 * ## Gaps, tags and messages
 *
 * A gap, DISCONT, a new segment, new caps, a flush or the end of the stream in
 * the middle of an exposure drops that coded frame: it is counted, and the
 * element message `codedexposure/frame-dropped` says `reason` ("gap",
 * "segment", "caps", "flush" or "eos"), `pts`, `inputs` (frames it had),
 * `needed` and `frames-dropped`. The next coded frame is DISCONT.
 *
 * The schedule goes downstream as the tag `comment=coded-exposure={...}`. A
 * coded frame is complete with its last input frame, and is stamped with the
 * first one: the difference is added to the latency.
 *
 * ## Example pipelines
 *
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball !
 * video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 !
 * codedexposure-sim full-well=10000 read-noise=5 psf-sigma=0.5 !
 * codedexposure-demux ! queue ! videoconvert ! autovideosink
 * ]| Coded at 25 frames/s, decoded to 100, with the noise of a real camera.
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball !
 * video/x-raw,format=GRAY8,width=768,height=576,framerate=200/1 !
 * codedexposure-sim schedule=staircase:2x2,active=9.8ms,switching=0.2ms !
 * video/x-raw,framerate=25/1 ! avenc_ffv1 ! matroskamux !
 * filesink location=coded.mkv
 * ]| Two input frames a slot, mirrors that take time to switch, recorded.
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball !
 * video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 !
 * codedexposure-sim dmd=sim:bench ! dmdsync device=sim:bench !
 * codedexposure-demux ! queue ! videoconvert ! autovideosink
 * ]| The masks come from a simulated DMD, as on a bench.
 *
 * Since: 0.1
 */
#include "gstcodedexposuresim.h"

#include "gstcodedexposurecaps.h"
#include "gstcodedexposuresimstate.h"

GST_DEBUG_CATEGORY (codedexposure_sim_debug);
#define GST_CAT_DEFAULT codedexposure_sim_debug

using namespace cexp;
using namespace cexp::gst;
using sim::SimState;

struct _GstCodedExposureSim {
  GstVideoFilter parent;
  SimState *state;
};

G_DEFINE_TYPE_WITH_CODE (GstCodedExposureSim, gst_coded_exposure_sim,
    GST_TYPE_VIDEO_FILTER,
    GST_DEBUG_CATEGORY_INIT (codedexposure_sim_debug, "codedexposure-sim", 0,
        "optical bench in software"))
GST_ELEMENT_REGISTER_DEFINE (codedexposure_sim, "codedexposure-sim",
    GST_RANK_NONE, GST_TYPE_CODED_EXPOSURE_SIM)

namespace
{

enum {
  PROP_0,
  PROP_SCHEDULE,
  PROP_DMD,
  PROP_PSF_SIGMA,
  PROP_FULL_WELL,
  PROP_READ_NOISE,
  PROP_BITS,
  PROP_GAIN,
  PROP_SEED,
  PROP_SHIFT_X,
  PROP_SHIFT_Y,
  PROP_ROTATION,
  PROP_SCALE,
  PROP_FRAMES_OUT,
  PROP_FRAMES_DROPPED,
};

#define DEFAULT_SCHEDULE "sequential:2x2"
#define DEFAULT_DMD ""

constexpr auto kReadWrite = GParamFlags (
    G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_PLAYING);
constexpr auto kReadWriteReady = GParamFlags (
    G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY);
constexpr auto kReadOnly =
    GParamFlags (G_PARAM_READABLE | G_PARAM_STATIC_STRINGS);

GstStaticPadTemplate sink_template = GST_STATIC_PAD_TEMPLATE ("sink",
    GST_PAD_SINK, GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate src_template = GST_STATIC_PAD_TEMPLATE ("src", GST_PAD_SRC,
    GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));

void
set_schedule (GstCodedExposureSim *self, std::string text)
{
  auto parsed =
      std::make_shared<const Result<Schedule>> (Schedule::parse (text));
  if (!*parsed)
    GST_WARNING_OBJECT (self, "%s", parsed->error ().message.c_str ());
  const ObjectLock lock (self);
  self->state->settings.schedule = std::move (text);
  self->state->settings.parsed = std::move (parsed);
}

/* The DMD is looked up once, when the stream starts. */
void
set_dmd (GstCodedExposureSim *self, const gchar *name)
{
  const ObjectLock lock (self);
  if (GST_STATE (self) > GST_STATE_READY)
    GST_WARNING_OBJECT (
        self, "dmd=%s is in force from the next start on", name ? name : "");
  self->state->settings.dmd = name ? name : "";
}

/* Where the number of a property is kept; null for other properties. */
double *
number_of (BenchOptions &optics, guint id)
{
  switch (id) {
  case PROP_PSF_SIGMA:
    return &optics.psf_sigma;
  case PROP_FULL_WELL:
    return &optics.full_well;
  case PROP_READ_NOISE:
    return &optics.read_noise;
  case PROP_GAIN:
    return &optics.gain;
  case PROP_SHIFT_X:
    return &optics.alignment.shift_x;
  case PROP_SHIFT_Y:
    return &optics.alignment.shift_y;
  case PROP_ROTATION:
    return &optics.alignment.rotation;
  case PROP_SCALE:
    return &optics.alignment.scale;
  default:
    return nullptr;
  }
}

void
set_optics (
    GstCodedExposureSim *self, guint id, const GValue *value, GParamSpec *pspec)
{
  const ObjectLock lock (self);
  BenchOptions &optics = self->state->settings.optics;
  if (double *number = number_of (optics, id))
    *number = g_value_get_double (value);
  else if (id == PROP_BITS)
    optics.bits = g_value_get_int (value);
  else if (id == PROP_SEED)
    optics.seed = g_value_get_uint64 (value);
  else
    G_OBJECT_WARN_INVALID_PROPERTY_ID (self, id, pspec);
}

void
set_property (GObject *object, guint id, const GValue *value, GParamSpec *pspec)
{
  auto *self = GST_CODED_EXPOSURE_SIM (object);
  if (id == PROP_SCHEDULE) {
    const gchar *text = g_value_get_string (value);
    set_schedule (self, text && *text ? text : DEFAULT_SCHEDULE);
  } else if (id == PROP_DMD) {
    set_dmd (self, g_value_get_string (value));
  } else {
    set_optics (self, id, value, pspec);
  }
}

void
get_property (GObject *object, guint id, GValue *value, GParamSpec *pspec)
{
  auto *self = GST_CODED_EXPOSURE_SIM (object);
  const ObjectLock lock (self);
  SimState &st = *self->state;
  if (const double *number = number_of (st.settings.optics, id))
    return g_value_set_double (value, *number);
  switch (id) {
  case PROP_SCHEDULE:
    return g_value_set_string (value, st.settings.schedule.c_str ());
  case PROP_DMD:
    return g_value_set_string (value, st.settings.dmd.c_str ());
  case PROP_BITS:
    return g_value_set_int (value, st.settings.optics.bits);
  case PROP_SEED:
    return g_value_set_uint64 (value, st.settings.optics.seed);
  case PROP_FRAMES_OUT:
    return g_value_set_uint64 (value, st.counters.frames_out);
  case PROP_FRAMES_DROPPED:
    return g_value_set_uint64 (value, st.counters.frames_dropped);
  default:
    G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
  }
}

gboolean
start (GstBaseTransform *trans)
{
  auto *self = GST_CODED_EXPOSURE_SIM (trans);
  std::string text;
  {
    const ObjectLock lock (self);
    text = self->state->settings.schedule;
  }
  /* A file may have changed since the property was set. */
  set_schedule (self, std::move (text));
  return sim::begin_stream (self);
}

gboolean
stop (GstBaseTransform *trans)
{
  SimState &st = *GST_CODED_EXPOSURE_SIM (trans)->state;
  st.stream = sim::Stream ();
  const ObjectLock lock (trans);
  st.schedule.reset ();
  st.latency = 0;
  return TRUE;
}

gboolean
take_caps (GstCodedExposureSim *self, GstEvent *event)
{
  auto *parent = GST_BASE_TRANSFORM_CLASS (gst_coded_exposure_sim_parent_class);
  const EventPtr kept (gst_event_ref (event));
  if (parent->sink_event (GST_BASE_TRANSFORM (self), event))
    return TRUE;
  GstCaps *caps = nullptr;
  gst_event_parse_caps (kept.get (), &caps);
  sim::explain_refusal (self, caps);
  return FALSE;
}

/* A dmdsync lets the start of a stream pass when the DMD has its masks. */
gboolean
take_stream_start (GstCodedExposureSim *self, GstEvent *event)
{
  auto *parent = GST_BASE_TRANSFORM_CLASS (gst_coded_exposure_sim_parent_class);
  sim::restart (self, sim::Drop::kSegment);
  self->state->stream.tag_due = true;
  return parent->sink_event (GST_BASE_TRANSFORM (self), event) &&
         sim::follow_schedule (self);
}

/* The tag follows the segment at once, since it is what the caps of a
 * demultiplexer wait for. */
gboolean
take_segment (GstCodedExposureSim *self, GstEvent *event)
{
  auto *parent = GST_BASE_TRANSFORM_CLASS (gst_coded_exposure_sim_parent_class);
  sim::restart (self, sim::Drop::kSegment);
  if (!parent->sink_event (GST_BASE_TRANSFORM (self), event))
    return FALSE;
  sim::push_tag (self);
  return TRUE;
}

gboolean
sink_event (GstBaseTransform *trans, GstEvent *event)
{
  auto *self = GST_CODED_EXPOSURE_SIM (trans);
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_CAPS:
    return take_caps (self, event);
  case GST_EVENT_SEGMENT:
    return take_segment (self, event);
  case GST_EVENT_STREAM_START:
    return take_stream_start (self, event);
  case GST_EVENT_EOS:
    sim::drop_exposure (self, sim::Drop::kEos);
    break;
  case GST_EVENT_FLUSH_STOP:
    sim::restart (self, sim::Drop::kFlush);
    break;
  default:
    break;
  }
  return GST_BASE_TRANSFORM_CLASS (gst_coded_exposure_sim_parent_class)
      ->sink_event (trans, event);
}

/* A coded frame leaves with its last input frame, and is stamped with the
 * first. */
gboolean
query (GstBaseTransform *trans, GstPadDirection direction, GstQuery *query)
{
  auto *self = GST_CODED_EXPOSURE_SIM (trans);
  auto *parent = GST_BASE_TRANSFORM_CLASS (gst_coded_exposure_sim_parent_class);
  if (!parent->query (trans, direction, query))
    return FALSE;
  if (direction != GST_PAD_SRC || GST_QUERY_TYPE (query) != GST_QUERY_LATENCY)
    return TRUE;

  GstClockTime own, min, max;
  gboolean live;
  {
    const ObjectLock lock (self);
    own = self->state->latency;
  }
  gst_query_parse_latency (query, &live, &min, &max);
  gst_query_set_latency (
      query, live, min + own, GST_CLOCK_TIME_IS_VALID (max) ? max + own : max);
  return TRUE;
}

void
finalize (GObject *object)
{
  delete GST_CODED_EXPOSURE_SIM (object)->state;
  G_OBJECT_CLASS (gst_coded_exposure_sim_parent_class)->finalize (object);
}

void
install_number (GObjectClass *klass, guint id, const char *name,
    const char *nick, const char *blurb, double low, double high, double value)
{
  g_object_class_install_property (klass, id,
      g_param_spec_double (name, nick, blurb, low, high, value, kReadWrite));
}

void
install_sources (GObjectClass *klass)
{
  /**
   * codedexposure-sim:schedule:
   *
   * Tile, code and timing of the exposure. Applied at the next coded frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_SCHEDULE,
      g_param_spec_string ("schedule", "Schedule",
          "Schedule of the coded exposure: a preset such as "
          "\"sequential:2x2\" or \"staircase:2x2,active=9.8ms\", or the path "
          "of a JSON file",
          DEFAULT_SCHEDULE, kReadWrite));
  /**
   * codedexposure-sim:dmd:
   *
   * A simulated DMD to take the masks from, and the schedule with them. Looked
   * up when the element starts.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_DMD,
      g_param_spec_string ("dmd", "DMD",
          "Simulated DMD, \"sim:NAME\", whose masks are looked through as a "
          "dmdsync with the same device shows them; its schedule wins over "
          "the property; empty: masks step with the frames",
          DEFAULT_DMD, kReadWriteReady));
}

void
install_sensor (GObjectClass *klass)
{
  const BenchOptions standard;
  /**
   * codedexposure-sim:full-well:
   *
   * Electrons that white makes in a pixel that is open in every slot, and the
   * most that a pixel holds. Applied at the next coded frame.
   *
   * Since: 0.1
   */
  install_number (klass, PROP_FULL_WELL, "full-well", "Full well",
      "Electrons that white makes in a pixel open in every slot, and the most "
      "it holds; gives shot noise; 0: no noise",
      0.0, BenchOptions::kMaxFullWell, standard.full_well);
  /**
   * codedexposure-sim:read-noise:
   *
   * Gaussian noise of each reading. Needs a full well. Applied at the next
   * coded frame.
   *
   * Since: 0.1
   */
  install_number (klass, PROP_READ_NOISE, "read-noise", "Read noise",
      "Noise of each reading in electrons rms; needs full-well", 0.0,
      BenchOptions::kMaxReadNoise, standard.read_noise);
  /**
   * codedexposure-sim:bits:
   *
   * Resolution of the sensor's converter: numbers are 0..2^bits - 1. Applied at
   * the next coded frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_BITS,
      g_param_spec_int ("bits", "Bits",
          "Significant bits of a pixel, counted from the lowest, for example "
          "12 for a 12-bit camera in GRAY16_LE; 0: all bits of the format",
          0, 16, standard.bits, kReadWrite));
  /**
   * codedexposure-sim:gain:
   *
   * Factor on the light. Applied at the next coded frame.
   *
   * Since: 0.1
   */
  install_number (klass, PROP_GAIN, "gain", "Gain",
      "Factor on the light; at 1, white makes white in a pixel open in every "
      "slot; 0: white makes white in the pixels that are open longest",
      0.0, BenchOptions::kMaxGain, standard.gain);
  /**
   * codedexposure-sim:seed:
   *
   * Start of the noise. Applied at the next coded frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_SEED,
      g_param_spec_uint64 ("seed", "Seed",
          "Start of the noise: the same seed gives the same bytes", 0,
          G_MAXUINT64, standard.seed, kReadWrite));
}

void
install_optics (GObjectClass *klass)
{
  const BenchOptions standard;
  /**
   * codedexposure-sim:psf-sigma:
   *
   * Blur between mirrors and pixels; it mixes the codes of neighbours. Applied
   * at the next coded frame.
   *
   * Since: 0.1
   */
  install_number (klass, PROP_PSF_SIGMA, "psf-sigma", "PSF sigma",
      "Standard deviation of the lens's Gaussian blur in pixels; 0: none", 0.0,
      BenchOptions::kMaxPsfSigma, standard.psf_sigma);
  /**
   * codedexposure-sim:shift-x:
   *
   * Applied at the next coded frame, as are the other three.
   *
   * Since: 0.1
   */
  install_number (klass, PROP_SHIFT_X, "shift-x", "Horizontal shift",
      "Mirrors by which the camera looks to the right of where it should",
      -BenchOptions::kMaxShift, BenchOptions::kMaxShift,
      standard.alignment.shift_x);
  /**
   * codedexposure-sim:shift-y:
   *
   * Since: 0.1
   */
  install_number (klass, PROP_SHIFT_Y, "shift-y", "Vertical shift",
      "Mirrors by which the camera looks below where it should",
      -BenchOptions::kMaxShift, BenchOptions::kMaxShift,
      standard.alignment.shift_y);
  /**
   * codedexposure-sim:rotation:
   *
   * Since: 0.1
   */
  install_number (klass, PROP_ROTATION, "rotation", "Rotation",
      "Degrees by which the camera is turned clockwise against the mirrors, "
      "about the centre of the picture",
      -180.0, 180.0, standard.alignment.rotation);
  /**
   * codedexposure-sim:scale:
   *
   * Since: 0.1
   */
  install_number (klass, PROP_SCALE, "scale", "Scale",
      "Pixels that a mirror is wide in the camera's picture",
      BenchOptions::kMinScale, BenchOptions::kMaxScale,
      standard.alignment.scale);
}

void
install_counters (GObjectClass *klass)
{
  /**
   * codedexposure-sim:frames-out:
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_FRAMES_OUT,
      g_param_spec_uint64 ("frames-out", "Frames out",
          "Coded frames made since the stream started", 0, G_MAXUINT64, 0,
          kReadOnly));
  /**
   * codedexposure-sim:frames-dropped:
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_FRAMES_DROPPED,
      g_param_spec_uint64 ("frames-dropped", "Frames dropped",
          "Coded frames that were begun and not completed, because of a gap, "
          "a flush, new caps or the end of the stream; notifies",
          0, G_MAXUINT64, 0, kReadOnly));
}

} // namespace

static void
gst_coded_exposure_sim_class_init (GstCodedExposureSimClass *klass)
{
  auto *object = G_OBJECT_CLASS (klass);
  object->set_property = GST_DEBUG_FUNCPTR (set_property);
  object->get_property = GST_DEBUG_FUNCPTR (get_property);
  object->finalize = GST_DEBUG_FUNCPTR (finalize);
  install_sources (object);
  install_optics (object);
  install_sensor (object);
  install_counters (object);

  auto *transform = GST_BASE_TRANSFORM_CLASS (klass);
  /* A video filter works in place where it can; a coded frame needs a buffer
   * of its own while input frames come. */
  transform->transform_ip = nullptr;
  transform->start = GST_DEBUG_FUNCPTR (start);
  transform->stop = GST_DEBUG_FUNCPTR (stop);
  transform->transform_caps = GST_DEBUG_FUNCPTR (sim::transform_caps);
  transform->fixate_caps = GST_DEBUG_FUNCPTR (sim::fixate_caps);
  transform->sink_event = GST_DEBUG_FUNCPTR (sink_event);
  transform->query = GST_DEBUG_FUNCPTR (query);
  transform->submit_input_buffer = GST_DEBUG_FUNCPTR (sim::submit_input_buffer);
  transform->generate_output = GST_DEBUG_FUNCPTR (sim::generate_output);
  GST_VIDEO_FILTER_CLASS (klass)->set_info = GST_DEBUG_FUNCPTR (sim::set_info);

  auto *element = GST_ELEMENT_CLASS (klass);
  for (auto *pad_template : {&sink_template, &src_template})
    gst_element_class_add_static_pad_template (element, pad_template);
  gst_element_class_set_static_metadata (element, "Coded exposure simulator",
      "Filter/Effect/Video",
      "An optical bench in software: turns video into the coded frames of a "
      "slow camera behind a micromirror device",
      "The gst-codedexposure authors");
}

static void
gst_coded_exposure_sim_init (GstCodedExposureSim *self)
{
  self->state = new SimState;
  set_schedule (self, DEFAULT_SCHEDULE);
  auto *trans = GST_BASE_TRANSFORM (self);
  gst_base_transform_set_prefer_passthrough (trans, FALSE);
  /* An instrument drops nothing because it is late. */
  gst_base_transform_set_qos_enabled (trans, FALSE);
}

namespace cexp::gst::sim
{

SimState &
state (GstCodedExposureSim *self)
{
  return *self->state;
}

} // namespace cexp::gst::sim

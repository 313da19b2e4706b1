/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-moirecalib
 * @title: moirecalib
 * @short_description: Aligns the camera with the mirrors and measures the
 * mapping between them
 *
 * moirecalib requests gratings from a dmdsync upstream and measures the pose of
 * the camera against the mirrors from their moiré fringes (paper, Section 2.3).
 *
 * First it shows one grating and draws the fringes in x and y, the numbers, and
 * the correction of the camera's stage over the picture. #moirecalib:state goes
 * from `searching` over `coarse` and `fine` to `aligned`, where every pixel is
 * within #moirecalib:tolerance mirrors of its place. Then, or at once with
 * `mode=map`, it shows Gray codes and gratings one after the other, releases
 * the mirrors, and solves for the mapping from each pixel to its mirror. The
 * mapping is the #moirecalib:mapping property, an element message, the file
 * #moirecalib:location, and a part of the stream tag with the schedule;
 * codedexposure-demux and codedexposure-fuse downstream use it from then on.
 *
 * Frames pass without delay: a separate thread solves and draws. While it is
 * busy, frames pass with the last panel.
 *
 * If the DMD takes no masks at run time, show a grating by other means and name
 * it (#moirecalib:pattern): alignment works then, mapping does not.
 *
 * `mode=phase` needs no pattern and works on recordings, too: it finds the
 * phase of the tile in coded frames, if pixels and mirrors are one to one and
 * the code gives its elements different light, as a staircase does. The
 * `moirecalib/phase` message tells the probability; downstream gets the
 * schedule with that phase.
 *
 * ## Messages
 *
 * `moirecalib/state`, `moirecalib/reading`, `moirecalib/mapping`,
 * `moirecalib/phase` and PROGRESS messages with the code `mapping`; see
 * docs/formats.md.
 *
 * ## Example pipeline
 *
 * |[
 * gst-launch-1.0 -m videotestsrc pattern=white !
 * video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 !
 * codedexposure-sim dmd=sim:bench rotation=0.5 scale=1.01 !
 * dmdsync device=sim:bench,size=768x576 !
 * moirecalib mode=map location=mapping.json report=mapping.png !
 * videoconvert ! autovideosink
 * ]| A simulated bench is mapped; the mapping is in mapping.json.
 *
 * Since: 0.1
 */
#include "common/caps.h"
#include "state.h"

GST_DEBUG_CATEGORY (moirecalib_debug);
#define GST_CAT_DEFAULT moirecalib_debug

using namespace codedexposure;
using namespace codedexposure::gst;
using moire::CalibState;
using moire::Mode;
using moire::Settings;

struct _GstMoireCalib {
  GstBaseTransform parent;
  CalibState *state;
};

G_DEFINE_TYPE_WITH_CODE (GstMoireCalib, gst_moire_calib,
    GST_TYPE_BASE_TRANSFORM,
    GST_DEBUG_CATEGORY_INIT (
        moirecalib_debug, "moirecalib", 0, "camera against mirrors"))
GST_ELEMENT_REGISTER_DEFINE (
    moirecalib, "moirecalib", GST_RANK_NONE, GST_TYPE_MOIRE_CALIB)

#define GST_TYPE_MOIRE_CALIB_MODE (gst_moire_calib_mode_get_type ())
G_DEFINE_ENUM_TYPE (GstMoireCalibMode, gst_moire_calib_mode,
    {int (Mode::automatic), "Alignment, and the mapping once it is aligned",
        "auto"},
    {int (Mode::align), "Alignment only", "align"},
    {int (Mode::map), "The mapping at once", "map"},
    {int (Mode::phase),
        "Phase of the tile, from a coded frame of a staircase; no patterns",
        "phase"})

namespace
{

enum {
  PROP_0,
  PROP_MODE,
  PROP_LOCATION,
  PROP_REPORT,
  PROP_PATTERN,
  PROP_SCHEDULE,
  PROP_OVERLAY,
  PROP_PERIOD,
  PROP_FRAMES,
  PROP_BITS,
  PROP_TOLERANCE,
  PROP_MIRROR_PITCH,
  PROP_PIXELS_PER_MIRROR,
  PROP_FLIP_X,
  PROP_FLIP_Y,
  PROP_FLIP_THETA,
  PROP_STATE,
  PROP_MAPPING,
};

const Settings kDefaults;

constexpr auto kPlaying = GParamFlags (
    G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_PLAYING);
constexpr auto kReadOnly =
    GParamFlags (G_PARAM_READABLE | G_PARAM_STATIC_STRINGS);

GstStaticPadTemplate sink_template = GST_STATIC_PAD_TEMPLATE ("sink",
    GST_PAD_SINK, GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate src_template = GST_STATIC_PAD_TEMPLATE ("src", GST_PAD_SRC,
    GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));

std::string
text_of (const GValue *value)
{
  const gchar *text = g_value_get_string (value);
  return text ? text : "";
}

void
set_stage_property (StageOptions &stage, guint id, const GValue *value)
{
  switch (id) {
  case PROP_TOLERANCE:
    stage.tolerance = g_value_get_double (value);
    break;
  case PROP_MIRROR_PITCH:
    stage.mirror_pitch = g_value_get_double (value);
    break;
  case PROP_PIXELS_PER_MIRROR:
    stage.pixels_per_mirror = g_value_get_double (value);
    break;
  case PROP_FLIP_X:
    stage.flip_x = g_value_get_boolean (value);
    break;
  case PROP_FLIP_Y:
    stage.flip_y = g_value_get_boolean (value);
    break;
  default:
    stage.flip_theta = g_value_get_boolean (value);
  }
}

void
set_property (
    GObject *object, guint id, const GValue *value, GParamSpec *pspec) noexcept
{
  const ObjectLock lock (object);
  Settings &settings = GST_MOIRE_CALIB (object)->state->settings;
  switch (id) {
  case PROP_MODE:
    settings.mode = Mode (g_value_get_enum (value));
    settings.turn++;
    break;
  case PROP_LOCATION:
    settings.location = text_of (value);
    break;
  case PROP_REPORT:
    settings.report = text_of (value);
    break;
  case PROP_PATTERN:
    settings.pattern = text_of (value);
    break;
  case PROP_SCHEDULE:
    settings.schedule = text_of (value);
    break;
  case PROP_OVERLAY:
    settings.overlay = g_value_get_boolean (value);
    break;
  case PROP_PERIOD:
    settings.period = g_value_get_int (value) / 2 * 2;
    break;
  case PROP_FRAMES:
    settings.frames = g_value_get_int (value);
    break;
  case PROP_BITS:
    settings.bits = g_value_get_int (value);
    break;
  case PROP_TOLERANCE:
  case PROP_MIRROR_PITCH:
  case PROP_PIXELS_PER_MIRROR:
  case PROP_FLIP_X:
  case PROP_FLIP_Y:
  case PROP_FLIP_THETA:
    set_stage_property (settings.stage, id, value);
    break;
  default:
    G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
  }
}

void
get_stage_property (
    const StageOptions &stage, guint id, GValue *value, GParamSpec *pspec)
{
  switch (id) {
  case PROP_TOLERANCE:
    return g_value_set_double (value, stage.tolerance);
  case PROP_MIRROR_PITCH:
    return g_value_set_double (value, stage.mirror_pitch);
  case PROP_PIXELS_PER_MIRROR:
    return g_value_set_double (value, stage.pixels_per_mirror);
  case PROP_FLIP_X:
    return g_value_set_boolean (value, stage.flip_x);
  case PROP_FLIP_Y:
    return g_value_set_boolean (value, stage.flip_y);
  case PROP_FLIP_THETA:
    return g_value_set_boolean (value, stage.flip_theta);
  default:
    g_warning ("no property %s", pspec->name);
  }
}

void
get_property (
    GObject *object, guint id, GValue *value, GParamSpec *pspec) noexcept
{
  const ObjectLock lock (object);
  const CalibState &st = *GST_MOIRE_CALIB (object)->state;
  const Settings &settings = st.settings;
  switch (id) {
  case PROP_MODE:
    return g_value_set_enum (value, int (settings.mode));
  case PROP_LOCATION:
    return g_value_set_string (value, settings.location.c_str ());
  case PROP_REPORT:
    return g_value_set_string (value, settings.report.c_str ());
  case PROP_PATTERN:
    return g_value_set_string (value, settings.pattern.c_str ());
  case PROP_SCHEDULE:
    return g_value_set_string (value, settings.schedule.c_str ());
  case PROP_OVERLAY:
    return g_value_set_boolean (value, settings.overlay);
  case PROP_PERIOD:
    return g_value_set_int (value, settings.period);
  case PROP_FRAMES:
    return g_value_set_int (value, settings.frames);
  case PROP_BITS:
    return g_value_set_int (value, settings.bits);
  case PROP_STATE:
    return g_value_set_string (value, session_stage_text (st.stage));
  case PROP_MAPPING:
    return g_value_set_string (value, st.mapping.c_str ());
  default:
    get_stage_property (settings.stage, id, value, pspec);
  }
}

void
before_transform (GstBaseTransform *trans, GstBuffer *) noexcept
{
  gst_base_transform_set_passthrough (
      trans, !moire::settings_of (GST_MOIRE_CALIB (trans)).lays_over ());
}

GstStateChangeReturn
change_state (GstElement *element, GstStateChange transition) noexcept
{
  auto *self = GST_MOIRE_CALIB (element);
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED) {
    moire::set_stage (self, moire::Stage::searching);
    if (!moire::start_worker (self))
      return GST_STATE_CHANGE_FAILURE;
  }
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY) {
    moire::release_mirrors (self);
    /* First, because the streaming thread may wait for it at the end. */
    moire::stop_worker (self);
  }
  const GstStateChangeReturn changed =
      GST_ELEMENT_CLASS (gst_moire_calib_parent_class)
          ->change_state (element, transition);
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED &&
      changed == GST_STATE_CHANGE_FAILURE)
    moire::stop_worker (self);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY)
    self->state->stream = moire::Stream ();
  return changed;
}

void
finalize (GObject *object)
{
  delete GST_MOIRE_CALIB (object)->state;
  G_OBJECT_CLASS (gst_moire_calib_parent_class)->finalize (object);
}

void
install_text (GObjectClass *klass, guint id, const char *name, const char *nick,
    const char *blurb, GParamFlags flags = kPlaying)
{
  g_object_class_install_property (
      klass, id, g_param_spec_string (name, nick, blurb, "", flags));
}

void
install_number (GObjectClass *klass, guint id, const char *name,
    const char *nick, const char *blurb, int least, int most, int value)
{
  g_object_class_install_property (klass, id,
      g_param_spec_int (name, nick, blurb, least, most, value, kPlaying));
}

void
install_flag (GObjectClass *klass, guint id, const char *name, const char *nick,
    const char *blurb, bool value)
{
  g_object_class_install_property (
      klass, id, g_param_spec_boolean (name, nick, blurb, value, kPlaying));
}

void
install_run (GObjectClass *klass)
{
  /**
   * moirecalib:mode:
   *
   * What to do. Setting it starts over at the next frame, even if the value
   * does not change.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_MODE,
      g_param_spec_enum ("mode", "Mode", "What to do; setting it starts over",
          GST_TYPE_MOIRE_CALIB_MODE, int (kDefaults.mode), kPlaying));
  /**
   * moirecalib:location:
   *
   * File for the mapping; empty: none.
   *
   * Since: 0.1
   */
  install_text (klass, PROP_LOCATION, "location", "Location",
      "File to write the mapping to, JSON (docs/formats.md)");
  /**
   * moirecalib:report:
   *
   * File for a picture of the result; empty: none.
   *
   * Since: 0.1
   */
  install_text (klass, PROP_REPORT, "report", "Report",
      "File for a picture of fringes, residuals and pixel quality, PNG");
  /**
   * moirecalib:pattern:
   *
   * For a DMD that takes no masks at run time. moirecalib then requests no
   * patterns and measures no mapping.
   *
   * Since: 0.1
   */
  install_text (klass, PROP_PATTERN, "pattern", "Pattern",
      "Grating that the mirrors show all the time, such as grating-both:4/0; "
      "empty: request patterns from dmdsync");
  /**
   * moirecalib:schedule:
   *
   * For `mode=phase` of a stream whose tags hold no schedule, or another one.
   *
   * Since: 0.1
   */
  install_text (klass, PROP_SCHEDULE, "schedule", "Schedule",
      "Schedule whose phase mode=phase finds, a preset or a JSON file; empty: "
      "the stream's. Read when the mode is set");
  /**
   * moirecalib:overlay:
   *
   * If false, frames pass unchanged, and only messages tell the readings.
   *
   * Since: 0.1
   */
  install_flag (klass, PROP_OVERLAY, "overlay", "Overlay",
      "Draw fringes, numbers and arrows over the picture, except in mode=phase",
      kDefaults.overlay);
  /**
   * moirecalib:period:
   *
   * Longer periods take more patterns and tolerate more blur.
   *
   * Since: 0.1
   */
  install_number (klass, PROP_PERIOD, "period", "Period",
      "Period of the gratings of a mapping, mirrors, even", 4, 64,
      kDefaults.period);
  /**
   * moirecalib:frames:
   *
   * More frames take longer and reduce noise.
   *
   * Since: 0.1
   */
  install_number (klass, PROP_FRAMES, "frames", "Frames",
      "Frames of each pattern of a mapping, which are averaged", 1, 1000,
      kDefaults.frames);
  /**
   * moirecalib:bits:
   *
   * It decides which pixels are saturated.
   *
   * Since: 0.1
   */
  install_number (klass, PROP_BITS, "bits", "Bits",
      "Significant bits of GRAY16_LE frames; 0: as the frame metadata say, or "
      "all 16",
      0, 16, kDefaults.bits);
  /**
   * moirecalib:state:
   *
   * Progress, as in the message `moirecalib/state`; notifies.
   *
   * Since: 0.1
   */
  install_text (klass, PROP_STATE, "state", "State",
      "searching, coarse, fine, aligned, mapping, solving, mapped, failed or "
      "found",
      kReadOnly);
  /**
   * moirecalib:mapping:
   *
   * As in #moirecalib:location; notifies.
   *
   * Since: 0.1
   */
  install_text (klass, PROP_MAPPING, "mapping", "Mapping",
      "The last mapping, JSON (docs/formats.md); empty: none yet", kReadOnly);
}

void
install_stage (GObjectClass *klass)
{
  const StageOptions &stage = kDefaults.stage;
  /**
   * moirecalib:tolerance:
   *
   * Alignment ends here.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_TOLERANCE,
      g_param_spec_double ("tolerance", "Tolerance",
          "The bench is aligned when every pixel is within this distance of "
          "its "
          "place, mirrors",
          0.001, 10, stage.tolerance, kPlaying));
  /**
   * moirecalib:mirror-pitch:
   *
   * Converts mirrors to micrometres of stage travel.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_MIRROR_PITCH,
      g_param_spec_double ("mirror-pitch", "Mirror pitch",
          "Stage travel for one mirror, micrometres: the pitch of the mirrors "
          "times the magnification of the optics",
          0.01, 1000, stage.mirror_pitch, kPlaying));
  /**
   * moirecalib:pixels-per-mirror:
   *
   * The magnification that alignment aims at; the search for fringes starts
   * there.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_PIXELS_PER_MIRROR,
      g_param_spec_double ("pixels-per-mirror", "Pixels per mirror",
          "Target magnification", 0.25, 16, stage.pixels_per_mirror, kPlaying));
  /**
   * moirecalib:flip-x:
   *
   * For stages whose x axis is reversed.
   *
   * Since: 0.1
   */
  install_flag (klass, PROP_FLIP_X, "flip-x", "Flip x",
      "The stage's x runs against the picture's", false);
  /**
   * moirecalib:flip-y:
   *
   * See #moirecalib:flip-x.
   *
   * Since: 0.1
   */
  install_flag (klass, PROP_FLIP_Y, "flip-y", "Flip y",
      "The stage's y runs against the picture's", false);
  /**
   * moirecalib:flip-theta:
   *
   * See #moirecalib:flip-x.
   *
   * Since: 0.1
   */
  install_flag (klass, PROP_FLIP_THETA, "flip-theta", "Flip theta",
      "The stage's angle runs anticlockwise in the picture", false);
}

} // namespace

namespace codedexposure::gst::moire
{

CalibState &
state (GstMoireCalib *self)
{
  return *self->state;
}

Settings
settings_of (GstMoireCalib *self)
{
  const ObjectLock lock (self);
  return self->state->settings;
}

} // namespace codedexposure::gst::moire

static void
gst_moire_calib_class_init (GstMoireCalibClass *klass)
{
  auto *object_class = G_OBJECT_CLASS (klass);
  auto *element_class = GST_ELEMENT_CLASS (klass);
  auto *transform_class = GST_BASE_TRANSFORM_CLASS (klass);

  object_class->set_property = set_property;
  object_class->get_property = get_property;
  object_class->finalize = finalize;
  install_run (object_class);
  install_stage (object_class);
  gst_type_mark_as_plugin_api (
      GST_TYPE_MOIRE_CALIB_MODE, GstPluginAPIFlags (0));

  gst_element_class_set_static_metadata (element_class, "Moiré calibration",
      "Filter/Analyzer/Video",
      "Aligns a coded exposure camera with its mirrors and measures the "
      "mapping between them",
      "The gst-codedexposure authors");
  gst_element_class_add_static_pad_template (element_class, &sink_template);
  gst_element_class_add_static_pad_template (element_class, &src_template);

  element_class->change_state = GST_DEBUG_FUNCPTR (change_state);
  transform_class->set_caps = GST_DEBUG_FUNCPTR (moire::set_caps);
  transform_class->sink_event = GST_DEBUG_FUNCPTR (moire::sink_event);
  transform_class->before_transform = GST_DEBUG_FUNCPTR (before_transform);
  transform_class->transform_ip = GST_DEBUG_FUNCPTR (moire::transform_ip);
}

static void
gst_moire_calib_init (GstMoireCalib *self)
{
  self->state = new CalibState;
  gst_base_transform_set_in_place (GST_BASE_TRANSFORM (self), TRUE);
  gst_base_transform_set_qos_enabled (GST_BASE_TRANSFORM (self), FALSE);
}

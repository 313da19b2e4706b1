/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties of codedexposure-sim: settings and counters. */
#include "state.h"

#define GST_CAT_DEFAULT codedexposure_sim_debug

namespace codedexposure::gst::sim
{

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

#define DEFAULT_DMD ""

constexpr auto kReadWrite = GParamFlags (
    G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_PLAYING);
constexpr auto kReadWriteReady = GParamFlags (
    G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY);
constexpr auto kReadOnly =
    GParamFlags (G_PARAM_READABLE | G_PARAM_STATIC_STRINGS);
/* The DMD is looked up once, when the stream starts. */
void
set_dmd (GstCodedExposureSim *self, const gchar *name)
{
  const ObjectLock lock (self);
  if (GST_STATE (self) > GST_STATE_READY)
    GST_WARNING_OBJECT (
        self, "dmd=%s is in force from the next start on", name ? name : "");
  state (self).settings.dmd = name ? name : "";
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
  BenchOptions &optics = state (self).settings.optics;
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
    set_schedule (self, text && *text ? text : kDefaultSchedule);
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
  SimState &st = state (self);
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
          kDefaultSchedule, kReadWrite));
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

void
set_schedule (GstCodedExposureSim *self, std::string text)
{
  auto parsed =
      std::make_shared<const Result<Schedule>> (Schedule::parse (text));
  if (!*parsed)
    GST_WARNING_OBJECT (self, "%s", parsed->error ().message.c_str ());
  const ObjectLock lock (self);
  state (self).settings.schedule = std::move (text);
  state (self).settings.parsed = std::move (parsed);
}

void
install_properties (GObjectClass *klass)
{
  klass->set_property = GST_DEBUG_FUNCPTR (set_property);
  klass->get_property = GST_DEBUG_FUNCPTR (get_property);
  install_sources (klass);
  install_optics (klass);
  install_sensor (klass);
  install_counters (klass);
}

} // namespace codedexposure::gst::sim

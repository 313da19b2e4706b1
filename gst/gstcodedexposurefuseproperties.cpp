/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties of codedexposure-fuse: settings and reports. */
#include "base/workers.h"
#include "gstcodedexposurefusestate.h"

#define GST_CAT_DEFAULT codedexposure_fuse_debug

namespace cexp::gst::fuse
{

namespace
{

enum {
  PROP_0,
  PROP_SCHEDULE,
  PROP_MAPPING,
  PROP_QUALITY,
  PROP_LOOKAHEAD,
  PROP_THREADS,
  PROP_FULL_WELL,
  PROP_READ_NOISE,
  PROP_BITS,
  PROP_FRAME_RATE,
  PROP_FRAMES_IN,
  PROP_FRAMES_OUT,
  PROP_FRAMES_LOST,
  PROP_FRAMES_CORRUPTED,
  PROP_SATURATED_FRAMES,
  PROP_MIRRORS_MIXED,
  PROP_MIRRORS_UNSEEN,
  PROP_SCHEDULE_IN_FORCE,
  PROP_STATS,
};

constexpr auto kReadWrite = GParamFlags (
    G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_PLAYING);
constexpr auto kReadOnly =
    GParamFlags (G_PARAM_READABLE | G_PARAM_STATIC_STRINGS);

#define GST_TYPE_CODED_EXPOSURE_QUALITY (coded_exposure_quality_get_type ())
GType
coded_exposure_quality_get_type ()
{
  static const GEnumValue values[] = {
      {int (FuseQuality::kFast), "one linear filter a pixel, in real time",
          "fast"},
      {int (FuseQuality::kBalanced),
          "the filter of the motion that fits around each pixel", "balanced"},
      {int (FuseQuality::kBest),
          "more motions, and what is alike in space and time made alike; for "
          "recordings",
          "best"},
      {0, nullptr, nullptr},
  };
  static gsize type = 0;
  if (g_once_init_enter (&type)) {
    const GType made =
        g_enum_register_static ("GstCodedExposureQuality", values);
    g_once_init_leave (&type, made);
  }
  return type;
}

void
set_property (
    GObject *object, guint id, const GValue *value, GParamSpec *pspec) noexcept
{
  auto *self = GST_CODED_EXPOSURE_FUSE (object);
  if (id == PROP_SCHEDULE)
    set_schedule (GST_ELEMENT (self), state (self).settings,
        g_value_get_string (value) ?: "");
  if (id == PROP_MAPPING)
    set_mapping (GST_ELEMENT (self), state (self).settings,
        g_value_get_string (value) ?: "");

  const ObjectLock lock (self);
  Settings &settings = state (self).settings;
  state (self).settings_changed = true;
  switch (id) {
  case PROP_SCHEDULE:
  case PROP_MAPPING:
    break;
  case PROP_QUALITY:
    settings.options.quality = FuseQuality (g_value_get_enum (value));
    break;
  case PROP_LOOKAHEAD:
    settings.options.lookahead = int (g_value_get_uint (value));
    break;
  case PROP_THREADS:
    settings.options.threads = int (g_value_get_uint (value));
    break;
  case PROP_FULL_WELL:
    settings.options.noise.full_well = g_value_get_double (value);
    break;
  case PROP_READ_NOISE:
    settings.options.noise.read_noise = g_value_get_double (value);
    break;
  case PROP_BITS:
    settings.options.bits = g_value_get_int (value);
    break;
  case PROP_FRAME_RATE:
    settings.rate = {gst_value_get_fraction_numerator (value),
        gst_value_get_fraction_denominator (value)};
    break;
  default:
    G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
  }
}

GstStructure *
stats (const Counters &counters)
{
  return gst_structure_new ("application/x-codedexposure-fuse-stats",
      "frames-in", G_TYPE_UINT64, counters.frames_in, "frames-out",
      G_TYPE_UINT64, counters.frames_out, "frames-lost", G_TYPE_UINT64,
      counters.frames_lost, "frames-corrupted", G_TYPE_UINT64,
      counters.frames_corrupted, "saturated-frames", G_TYPE_UINT64,
      counters.saturated_frames, "mirrors-exact", G_TYPE_UINT64,
      guint64 (counters.rectified.exact), "mirrors-weighted", G_TYPE_UINT64,
      guint64 (counters.rectified.weighted), "mirrors-mixed", G_TYPE_UINT64,
      guint64 (counters.rectified.mixed), "mirrors-unseen", G_TYPE_UINT64,
      guint64 (counters.rectified.unseen), nullptr);
}

void
get_property (
    GObject *object, guint id, GValue *value, GParamSpec *pspec) noexcept
{
  auto *self = GST_CODED_EXPOSURE_FUSE (object);
  const ObjectLock lock (self);
  const FuseState &st = state (self);
  const Settings &settings = st.settings;
  switch (id) {
  case PROP_SCHEDULE:
    g_value_set_string (value, settings.schedule.c_str ());
    break;
  case PROP_MAPPING:
    g_value_set_string (value, settings.mapping.c_str ());
    break;
  case PROP_QUALITY:
    g_value_set_enum (value, int (settings.options.quality));
    break;
  case PROP_LOOKAHEAD:
    g_value_set_uint (value, guint (settings.options.lookahead));
    break;
  case PROP_THREADS:
    g_value_set_uint (value, guint (settings.options.threads));
    break;
  case PROP_FULL_WELL:
    g_value_set_double (value, settings.options.noise.full_well);
    break;
  case PROP_READ_NOISE:
    g_value_set_double (value, settings.options.noise.read_noise);
    break;
  case PROP_BITS:
    g_value_set_int (value, settings.options.bits);
    break;
  case PROP_FRAME_RATE:
    gst_value_set_fraction (value, settings.rate.num, settings.rate.den);
    break;
  case PROP_FRAMES_IN:
    g_value_set_uint64 (value, st.counters.frames_in);
    break;
  case PROP_FRAMES_OUT:
    g_value_set_uint64 (value, st.counters.frames_out);
    break;
  case PROP_FRAMES_LOST:
    g_value_set_uint64 (value, st.counters.frames_lost);
    break;
  case PROP_FRAMES_CORRUPTED:
    g_value_set_uint64 (value, st.counters.frames_corrupted);
    break;
  case PROP_SATURATED_FRAMES:
    g_value_set_uint64 (value, st.counters.saturated_frames);
    break;
  case PROP_MIRRORS_MIXED:
    g_value_set_uint64 (value, st.counters.rectified.mixed);
    break;
  case PROP_MIRRORS_UNSEEN:
    g_value_set_uint64 (value, st.counters.rectified.unseen);
    break;
  case PROP_SCHEDULE_IN_FORCE:
    g_value_set_string (
        value, st.in_force ? st.in_force->text ().c_str () : "");
    break;
  case PROP_STATS:
    g_value_take_boxed (value, stats (st.counters));
    break;
  default:
    G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
  }
}

void
install_camera (GObjectClass *klass)
{
  /**
   * codedexposure-fuse:full-well:
   *
   * How much light the camera counts. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_FULL_WELL,
      g_param_spec_double ("full-well", "Full well",
          "Electrons that white makes in a pixel that is open for the whole "
          "exposure, as in codedexposure-sim; the noise of light follows from "
          "it; 0: the frames are noise-free",
          0.0, SensorNoise::kMaxFullWell, 0.0, kReadWrite));
  /**
   * codedexposure-fuse:read-noise:
   *
   * Noise of the camera in the dark. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_READ_NOISE,
      g_param_spec_double ("read-noise", "Read noise",
          "Noise of the camera's electronics in electrons rms; counts only "
          "with a full-well",
          0.0, SensorNoise::kMaxReadNoise, 0.0, kReadWrite));
  /**
   * codedexposure-fuse:bits:
   *
   * Significant bits, for pixels that fill only a part of GRAY16_LE.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_BITS,
      g_param_spec_int ("bits", "Bits",
          "Significant bits of a pixel, counted from the lowest, for example "
          "12 for a 12-bit camera in GRAY16_LE; 0: all bits of the format",
          0, 16, 0, kReadWrite));
  /**
   * codedexposure-fuse:frame-rate:
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
}

void
install_settings (GObjectClass *klass)
{
  /**
   * codedexposure-fuse:schedule:
   *
   * Tile, code and timing of the exposure. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_SCHEDULE,
      g_param_spec_string ("schedule", "Schedule",
          "Schedule of the coded exposure: a preset such as "
          "\"sequential:lattice:4/2\", or the path of a JSON file; empty: "
          "what the stream's tag says, else sequential:2x2",
          "", kReadWrite));
  /**
   * codedexposure-fuse:mapping:
   *
   * A file with the mapping from camera pixels to mirrors, as moirecalib writes
   * it; wins over what the stream's tags say. Frames are then rectified to one
   * pixel a mirror before they are fused, so that fused frames have the size of
   * the mirrors. Empty: the mapping of the tags, or none. Applied at the next
   * frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_MAPPING,
      g_param_spec_string ("mapping", "Mapping",
          "File with the mapping from camera pixels to mirrors (moirecalib "
          "writes one); empty: that of the stream's tags, or none",
          "", kReadWrite));
  /**
   * codedexposure-fuse:quality:
   *
   * How much work a frame is worth. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_QUALITY,
      g_param_spec_enum ("quality", "Quality",
          "How much work a frame is worth; balanced and best are for up to 16 "
          "slots",
          GST_TYPE_CODED_EXPOSURE_QUALITY, int (FuseQuality::kFast),
          kReadWrite));
  /**
   * codedexposure-fuse:lookahead:
   *
   * Coded frames that are waited for before one is fused. Applied at the next
   * frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_LOOKAHEAD,
      g_param_spec_uint ("lookahead", "Lookahead",
          "Coded frames that are waited for before one is fused: what stands "
          "still is then known from the first frame on; each adds a frame "
          "period to the latency",
          0, guint (Fuser<std::uint8_t>::kMaxLookahead), 0, kReadWrite));
  /**
   * codedexposure-fuse:threads:
   *
   * Threads that share the work of balanced and best. Applied at the next
   * frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_THREADS,
      g_param_spec_uint ("threads", "Threads",
          "Threads that balanced and best work on, which changes no pixel; 0: "
          "one for each processor; fast works on the streaming thread",
          0, guint (Workers::kMost), 0, kReadWrite));
  install_camera (klass);
}

/* Counters that run with the frames do not notify; that of losses does. */
void
install_reports (GObjectClass *klass)
{
  const auto counter = [klass] (guint id, const char *name, const char *nick,
                           const char *blurb) {
    g_object_class_install_property (klass, id,
        g_param_spec_uint64 (name, nick, blurb, 0, G_MAXUINT64, 0, kReadOnly));
  };
  counter (PROP_FRAMES_IN, "frames-in", "Frames in",
      "Coded frames that came in since the stream started");
  counter (PROP_FRAMES_OUT, "frames-out", "Frames out",
      "Frames that were taken downstream");
  counter (PROP_FRAMES_LOST, "frames-lost", "Frames lost",
      "Coded frames that never came, by the gaps between time stamps; "
      "notifies");
  counter (PROP_FRAMES_CORRUPTED, "frames-corrupted", "Frames corrupted",
      "Coded frames that upstream flagged as corrupted; notifies");
  counter (PROP_SATURATED_FRAMES, "saturated-frames", "Saturated frames",
      "Coded frames with a pixel at the largest value; notifies when a "
      "stretch of them begins or ends");
  counter (PROP_MIRRORS_MIXED, "mirrors-mixed", "Mirrors mixed",
      "Mirrors of the mapping in force of which even the best pixel gets less "
      "than half of its light; notifies");
  counter (PROP_MIRRORS_UNSEEN, "mirrors-unseen", "Mirrors unseen",
      "Mirrors of the mapping in force at which no pixel looks, black; "
      "notifies");
  /**
   * codedexposure-fuse:schedule-in-force:
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_SCHEDULE_IN_FORCE,
      g_param_spec_string ("schedule-in-force", "Schedule in force",
          "The schedule that frames are fused by, from the property, the tag "
          "or by default; empty before the first frame; notifies",
          "", kReadOnly));
  /**
   * codedexposure-fuse:stats:
   *
   * All counters at one moment, as `application/x-codedexposure-fuse-stats`
   * with a guint64 for each counter property, under its name.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_STATS,
      g_param_spec_boxed ("stats", "Statistics", "All counters at one moment",
          GST_TYPE_STRUCTURE, kReadOnly));
}

} // namespace

void
install_properties (GObjectClass *klass)
{
  klass->set_property = GST_DEBUG_FUNCPTR (set_property);
  klass->get_property = GST_DEBUG_FUNCPTR (get_property);
  install_settings (klass);
  install_reports (klass);
  gst_type_mark_as_plugin_api (
      GST_TYPE_CODED_EXPOSURE_QUALITY, GstPluginAPIFlags (0));
}

} // namespace cexp::gst::fuse

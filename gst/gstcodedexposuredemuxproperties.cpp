/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties of codedexposure-demux: settings and reports. */
#include "gstcodedexposuredemuxstate.h"

#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace cexp::gst::demux
{

namespace
{

enum {
  PROP_0,
  PROP_SCHEDULE,
  PROP_MAPPING,
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
  PROP_MIRRORS_MIXED,
  PROP_MIRRORS_UNSEEN,
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

#define GST_TYPE_CODED_EXPOSURE_METHOD (coded_exposure_method_get_type ())
GType
coded_exposure_method_get_type ()
{
  static const GEnumValue values[] = {
      {int (Method::kAuto),
          "select for one-hot codes without leak, decode for other codes that "
          "can be inverted, else rank",
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
set_property (
    GObject *object, guint id, const GValue *value, GParamSpec *pspec) noexcept
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (object);
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
    settings.rate = {gst_value_get_fraction_numerator (value),
        gst_value_get_fraction_denominator (value)};
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
      counters.saturated_frames, "mirrors-exact", G_TYPE_UINT64,
      guint64 (counters.rectified.exact), "mirrors-weighted", G_TYPE_UINT64,
      guint64 (counters.rectified.weighted), "mirrors-mixed", G_TYPE_UINT64,
      guint64 (counters.rectified.mixed), "mirrors-unseen", G_TYPE_UINT64,
      guint64 (counters.rectified.unseen), nullptr);
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
  case PROP_MIRRORS_MIXED:
    g_value_set_uint64 (value, st.counters.rectified.mixed);
    return true;
  case PROP_MIRRORS_UNSEEN:
    g_value_set_uint64 (value, st.counters.rectified.unseen);
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
get_property (
    GObject *object, guint id, GValue *value, GParamSpec *pspec) noexcept
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (object);
  const ObjectLock lock (self);
  const Settings &settings = state (self).settings;
  switch (id) {
  case PROP_SCHEDULE:
    g_value_set_string (value, settings.schedule.c_str ());
    break;
  case PROP_MAPPING:
    g_value_set_string (value, settings.mapping.c_str ());
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
    gst_value_set_fraction (value, settings.rate.num, settings.rate.den);
    break;
  case PROP_QOS:
    g_value_set_boolean (value, settings.qos);
    break;
  default:
    if (!get_report (state (self), id, value))
      G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
  }
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
   * codedexposure-demux:mapping:
   *
   * A file with the mapping from camera pixels to mirrors, as moirecalib writes
   * it; wins over what the stream's tags say. Frames are then rectified to one
   * pixel a mirror before they are taken apart, so that subframes have the size
   * that the mirrors give them. Empty: the mapping of the tags, or none.
   * Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_MAPPING,
      g_param_spec_string ("mapping", "Mapping",
          "File with the mapping from camera pixels to mirrors (moirecalib "
          "writes one); empty: that of the stream's tags, or none",
          "", kReadWrite));
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
          0.0, ExtractOptions::kMaxGain, DEFAULT_GAIN, kReadWrite));
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
  install_counter (klass, PROP_MIRRORS_MIXED, "mirrors-mixed", "Mirrors mixed",
      "Mirrors of the mapping in force of which even the best pixel gets less "
      "than half of its light");
  install_counter (klass, PROP_MIRRORS_UNSEEN, "mirrors-unseen",
      "Mirrors unseen",
      "Mirrors of the mapping in force at which no pixel looks; black");
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

void
install_properties (GObjectClass *klass)
{
  klass->set_property = GST_DEBUG_FUNCPTR (set_property);
  klass->get_property = GST_DEBUG_FUNCPTR (get_property);
  install_settings (klass);
  install_reports (klass);
  gst_type_mark_as_plugin_api (
      GST_TYPE_CODED_EXPOSURE_METHOD, GstPluginAPIFlags (0));
}

} // namespace cexp::gst::demux

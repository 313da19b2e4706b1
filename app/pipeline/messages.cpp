/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "messages.h"

#include <sys/resource.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "common/beam.h"
#include "common/messages.h"
#include "pipeline/cameras.h"
#include "pipeline/graph.h"
#include "pipeline/pads.h"

namespace codedexposure::app
{

namespace
{

using namespace gst;

/** Elements outside of GStreamer's base package, and their Debian packages. */
struct Provider {
  std::string_view element, package;
};
constexpr Provider kProviders[] = {
    {"aravissrc", "libaravis-0.8-0"},
    {"autovideosink", "gstreamer1.0-plugins-good"},
    {"avdec_ffv1", "gstreamer1.0-libav"},
    {"avenc_ffv1", "gstreamer1.0-libav"},
    {"cairooverlay", "gstreamer1.0-plugins-good"},
    {"matroskademux", "gstreamer1.0-plugins-good"},
    {"matroskamux", "gstreamer1.0-plugins-good"},
    {"pngenc", "gstreamer1.0-plugins-good"},
    {"textoverlay", "gstreamer1.0-x"},
    {"x264enc", "gstreamer1.0-plugins-ugly"},
    {"ximagesink", "gstreamer1.0-x"},
};

/* As in a shell command, without GStreamer's escapes. */
std::string
quoted (const std::string &text)
{
  return text.empty () || text.find (' ') != text.npos ? '"' + text + '"'
                                                       : text;
}

/* The largest number means that a value is not known. */
std::string
value_text (const GValue *value)
{
  if (G_VALUE_HOLDS_STRING (value)) {
    const gchar *given = g_value_get_string (value);
    return quoted (given ? given : "");
  }
  if (G_VALUE_HOLDS_UINT64 (value) && g_value_get_uint64 (value) == G_MAXUINT64)
    return "unknown";
  const CharPtr text (gst_value_serialize (value));
  return text ? text.get () : "?";
}

bool
is_integer (GType type)
{
  return type == G_TYPE_UINT64 || type == G_TYPE_UINT || type == G_TYPE_INT;
}

StructurePtr
stats_of (GstElement *element)
{
  GstStructure *stats = nullptr;
  if (g_object_class_find_property (G_OBJECT_GET_CLASS (element), "stats"))
    g_object_get (element, "stats", &stats, nullptr);
  return StructurePtr (stats);
}

/* The counters in the property stats. */
std::string
numbers_in (const GstStructure *stats)
{
  std::string text;
  for (gint i = 0; i < gst_structure_n_fields (stats); i++) {
    const gchar *field = gst_structure_nth_field_name (stats, guint (i));
    const GValue *value = gst_structure_get_value (stats, field);
    if (is_integer (G_VALUE_TYPE (value)))
      text += std::string (" ") + field + "=" + value_text (value);
  }
  return text;
}

/* The counters of an element without stats, which are read-only properties. */
std::string
read_only_numbers (GstElement *element)
{
  std::string text;
  guint n = 0;
  GParamSpec **specs =
      g_object_class_list_properties (G_OBJECT_GET_CLASS (element), &n);
  for (guint i = 0; i < n; i++) {
    if ((specs[i]->flags & G_PARAM_WRITABLE) ||
        !is_integer (specs[i]->value_type))
      continue;
    GValue value = G_VALUE_INIT;
    g_object_get_property (G_OBJECT (element), specs[i]->name, &value);
    text += std::string (" ") + specs[i]->name + "=" + value_text (&value);
    g_value_unset (&value);
  }
  g_free (specs);
  return text;
}

std::string
numbers_of (GstElement *element)
{
  const StructurePtr stats = stats_of (element);
  return stats ? numbers_in (stats.get ()) : read_only_numbers (element);
}

std::string
frames_shown_by (GstElement *sink)
{
  const StructurePtr stats = stats_of (sink);
  guint64 rendered = 0, dropped = 0;
  gst_structure_get (stats.get (), "rendered", G_TYPE_UINT64, &rendered,
      "dropped", G_TYPE_UINT64, &dropped, nullptr);
  return format (" shown=%" G_GUINT64_FORMAT " late=%" G_GUINT64_FORMAT,
      rendered, dropped);
}

/* The details of a debug text after the position in the code, or null. */
const gchar *
added (const gchar *debug)
{
  const gchar *end_of_place = debug ? std::strchr (debug, '\n') : nullptr;
  return end_of_place ? end_of_place + 1 : nullptr;
}

bool
is_video_sink (GstElement *element, GstElementFactory *factory)
{
  const gchar *klass =
      gst_element_factory_get_metadata (factory, GST_ELEMENT_METADATA_KLASS);
  return std::strstr (klass, "Sink") && std::strstr (klass, "Video") &&
         g_object_class_find_property (G_OBJECT_GET_CLASS (element), "stats");
}

} // namespace

std::string
format (const char *pattern, ...)
{
  va_list arguments;
  va_start (arguments, pattern);
  const CharPtr text (g_strdup_vprintf (pattern, arguments));
  va_end (arguments);
  return text.get ();
}

std::string
joined (const std::vector<std::string> &texts)
{
  std::string all;
  for (const std::string &text : texts)
    all += (all.empty () ? "" : ", ") + text;
  return all;
}

double
seconds_since (std::chrono::steady_clock::time_point begin)
{
  using Seconds = std::chrono::duration<double>;
  return Seconds (std::chrono::steady_clock::now () - begin).count ();
}

std::string
coded_frames (std::uint64_t count)
{
  return std::to_string (count) +
         (count == 1 ? " coded frame" : " coded frames");
}

std::string
minutes (double seconds)
{
  const int whole = int (seconds + 0.5);
  return format ("%d:%02d", whole / 60, whole % 60);
}

double
cpu_seconds ()
{
  rusage usage = {};
  getrusage (RUSAGE_SELF, &usage);
  const auto seconds = [] (const timeval &t) {
    return double (t.tv_sec) + 1e-6 * double (t.tv_usec);
  };
  return seconds (usage.ru_utime) + seconds (usage.ru_stime);
}

std::string
package_of (std::string_view element)
{
  for (const Provider &provider : kProviders)
    if (provider.element == element)
      return std::string (provider.package);
  return {};
}

Told::Told (GstMessage *message)
{
  const auto parse = GST_MESSAGE_TYPE (message) == GST_MESSAGE_ERROR
                         ? gst_message_parse_error
                     : GST_MESSAGE_TYPE (message) == GST_MESSAGE_WARNING
                         ? gst_message_parse_warning
                         : gst_message_parse_info;
  GError *parsed = nullptr;
  gchar *text = nullptr;
  parse (message, &parsed, &text);
  error.reset (parsed);
  debug.reset (text);
}

namespace
{

bool
is_unfit (const Told &told)
{
  return told.debug && std::strstr (told.debug.get (), "not-negotiated");
}

bool
is_change_of_format (std::string_view kind, const Told &told)
{
  return (kind == "codedexposure-stack" || kind == "codedexposure-recordmux" ||
             kind == "x264enc") &&
         g_error_matches (
             told.error.get (), GST_STREAM_ERROR, GST_STREAM_ERROR_FORMAT);
}

bool
has_property (GstObject *object, const char *name)
{
  return g_object_class_find_property (G_OBJECT_GET_CLASS (object), name);
}

/* That @source reads, with a blank before it; empty: none, or the first that is
 * found. */
std::string
camera_of (GstObject *source)
{
  const std::string name = has_property (source, "camera-name")
                               ? text_property (source, "camera-name")
                               : "";
  return name.empty () ? "" : " " + name;
}

bool
is_of_second_camera (GstMessage *message)
{
  GstObject *source = GST_MESSAGE_SRC (message);
  Beam beam = Beam::kOn;
  if (has_property (source, "beam"))
    g_object_get (source, "beam", &beam, nullptr);
  return beam == Beam::kOff ||
         gst_structure_has_field (
             gst_message_get_structure (message), "camera");
}

} // namespace

bool
is_silence (std::string_view kind, const Told &told)
{
  return kind == "aravissrc" && told.error->domain == GST_STREAM_ERROR &&
         !is_unfit (told);
}

MessagePtr
next_message (GstElement *pipeline, int types, GstClockTime patience)
{
  const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline));
  return MessagePtr (gst_bus_timed_pop_filtered (
      bus.get (), patience, GstMessageType (types)));
}

std::string
told (GstMessage *message)
{
  const Told parts (message);
  const gchar *detail = added (parts.debug.get ());
  GstObject *source = GST_MESSAGE_SRC (message);
  std::string name = GST_OBJECT_NAME (source);
  if (const std::string camera = camera_of (source); !camera.empty ())
    name = "camera" + camera;
  if (parts.error->domain == GST_RESOURCE_ERROR &&
      has_property (source, "location"))
    if (const auto file = text_property (source, "location"); !file.empty ())
      name = file;
  if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_INFO && detail)
    return name + ": " + detail;
  return name + ": " + parts.error->message +
         (detail ? std::string ("\n    ") + detail : "");
}

std::string
remedy_for (std::string_view kind, const Told &told, const std::string &change)
{
  const GError *error = told.error.get ();
  const bool unfit = is_unfit (told);
  if (!change.empty () && (unfit || is_change_of_format (kind, told)))
    return "the schedule changes " + change +
           ", and with it the size or the rate of the pictures, of which a "
           "file has one; write a folder of pictures (--output NAME/), or each "
           "part to a file of its own (--excerpt)";
  const bool of_camera =
      kind == "aravissrc" || kind == "codedexposure-camerasrc";
  if (g_error_matches (
          error, GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NO_SPACE_LEFT))
    return "the disk is full; delete files, or write to another disk";
  if (kind == "tcpserversink" && error->domain == GST_RESOURCE_ERROR)
    return "--host must be an address of this machine (0.0.0.0: all), and "
           "--port one that no other program listens on";
  if (of_camera &&
      g_error_matches (error, GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NOT_FOUND))
    return cameras_found ();
  if (unfit && of_camera)
    return "the camera does not send such frames; check --size, --frame-rate, "
           "--bits and --pixel-format";
  if (unfit)
    return "two elements do not agree on a format; check --size and --bits";
  const std::string_view text = error->message;
  const bool of_lines = of_camera && text.find ("LineSelector") != text.npos;
  const bool of_source = of_camera && text.find ("TriggerSource") != text.npos;
  if ((of_lines || of_source) && text.find ("not an entry") != text.npos)
    return "the camera has no such line; set --trigger-line to one that "
           "\"codedexposure camera show\" lists";
  if (of_lines)
    return "--trigger camera needs a camera with the feature LineSelector; for "
           "others, use --trigger none and set their output with --features";
  if (of_camera && text.find ("[PixelFormat]") != text.npos)
    return "the camera has no such pixel format; set --pixel-format to one "
           "that \"codedexposure camera show\" lists";
  if (is_silence (kind, told))
    return "the camera sent nothing for 2 s; check its cable and, if a DMD "
           "triggers it, that the DMD runs and is wired to its trigger line";
  return {};
}

std::string
fields_of (GstMessage *message)
{
  const GstStructure *structure = gst_message_get_structure (message);
  std::string text =
      format ("%s: %s", GST_OBJECT_NAME (GST_MESSAGE_SRC (message)),
          gst_structure_get_name (structure));
  for (gint i = 0; i < gst_structure_n_fields (structure); i++) {
    const gchar *field = gst_structure_nth_field_name (structure, guint (i));
    text += std::string (" ") + field + "=" +
            value_text (gst_structure_get_value (structure, field));
  }
  return text;
}

std::string
counters_of (GstElement *element)
{
  GstElementFactory *factory = gst_element_get_factory (element);
  if (!factory)
    return {};
  const gchar *plugin =
      gst_plugin_feature_get_plugin_name (GST_PLUGIN_FEATURE (factory));
  std::string counters;
  if (plugin && std::strcmp (plugin, "codedexposure") == 0)
    counters = numbers_of (element);
  else if (is_video_sink (element, factory))
    counters = frames_shown_by (element);
  return counters.empty () ? counters
                           : GST_OBJECT_NAME (element) + (":" + counters);
}

namespace
{

std::string
number (guint64 value)
{
  return value == G_MAXUINT64 ? "unknown" : std::to_string (value);
}

std::string
in_seconds (GstClockTime time)
{
  return format ("%.3f s", 1e-9 * double (time));
}

/* As --excerpt and the tables of pictures count. */
std::string
position_of (GstMessage *posted, GstClockTime time, GstClockTime origin)
{
  GstObject *source = GST_MESSAGE_SRC (posted);
  const ObjectPtr<GstPad> pad (
      GST_IS_ELEMENT (source)
          ? gst_element_get_static_pad (GST_ELEMENT (source), "src")
          : nullptr);
  const GstClockTime position = pad ? stream_time (pad.get (), time) : time;
  return in_seconds (position - std::min (position, origin));
}

std::string
slip_text (int slots)
{
  const int count = std::abs (slots);
  return format ("%d slot%s %s", count, count == 1 ? "" : "s",
      slots < 0 ? "early" : "late");
}

} // namespace

std::string
notice (GstMessage *posted, GstClockTime origin)
{
  const GstStructure *message = gst_message_get_structure (posted);
  const std::string of =
      is_of_second_camera (posted) ? " of the second camera" : "";
  const auto place_of = [&] (GstClockTime time) {
    return position_of (posted, time, origin);
  };
  if (const auto lost = from_structure<FramesLost> (message))
    return "warning: coded frames" + of + " were lost before " +
           place_of (lost->to) + ": " + number (lost->count);
  if (const auto incomplete = from_structure<FrameIncomplete> (message))
    return "warning: frame " + number (incomplete->frame) + of +
           " arrived incomplete; check the connection of the camera";
  if (const auto late = from_structure<FrameLate> (message))
    return "warning: frame " + number (late->frame) + of +
           " arrived after the next one";
  if (const auto slip = from_structure<Slip> (message))
    return "warning: from frame " + number (slip->frame) + of +
           " on, the mirrors are " + slip_text (slip->slots) +
           "; these frames are flagged";
  if (const auto damaged = from_structure<FramesDamaged> (message)) {
    const std::string at = place_of (damaged->from);
    const std::string frame =
        damaged->frame ? "frame " + number (*damaged->frame) : at;
    return damaged->active
               ? "warning: from " + frame +
                     (damaged->frame ? " (" + at + ")" : "") + " on, frames" +
                     of + " are flagged: " + quoted (damaged->reason)
               : "warning: frames" + of + " that are flagged from " + frame +
                     " on: " + number (damaged->count.value_or (0));
  }
  if (const auto lost = from_structure<PartnerLost> (message))
    return lost->active ? "warning: from " + place_of (lost->from) +
                              " on, coded frames have no partner of the second "
                              "camera: " +
                              quoted (lost->reason)
                        : "warning: coded frames without a partner from " +
                              place_of (lost->from) +
                              " on: " + number (lost->frames.value_or (0));
  if (const auto drifted = from_structure<PartnerDrifted> (message))
    return drifted->active
               ? format (
                     "warning: the second camera sees the mirrors at %+.2f, "
                     "%+.2f mirrors (right, down) from where its mapping "
                     "has them, above the limit of 0.1: a camera was moved; "
                     "calibrate both again",
                     drifted->x, drifted->y)
               : "the second camera sees the mirrors where its mapping has "
                 "them "
                 "again";
  if (const auto missing = from_structure<FramesMissing> (message))
    return "warning: from " + place_of (missing->from) +
           " on, recorded frames" + of +
           " are missing: " + number (missing->count);
  if (from_structure<StreamCut> (message))
    return "warning: the stream" + of +
           " ended without its last line: it was cut off, its sender was "
           "stopped, or it is a segment of a longer recording";
  if (const auto incomplete = from_structure<StreamIncomplete> (message))
    return "warning: recorded frames" + of +
           " are missing with all that is known of them: " +
           number (incomplete->count) +
           "; the recording is damaged, or this is not its first part";
  if (const auto back = from_structure<CameraBack> (message))
    return "the camera" + camera_of (GST_MESSAGE_SRC (posted)) +
           " sends frames again, after " + in_seconds (back->silent);
  if (const auto phase = from_structure<MoirePhase> (message))
    return "phase found: --schedule " + quoted (phase->schedule);
  return {};
}

guint64
counter_of (GstElement *element, const char *counter)
{
  guint64 count = 0;
  if (const StructurePtr stats = stats_of (element))
    gst_structure_get_uint64 (stats.get (), counter, &count);
  return count;
}

guint64
counters_of (const std::vector<GstElement *> &elements, const char *counter)
{
  guint64 sum = 0;
  for (GstElement *element : elements)
    sum += counter_of (element, counter);
  return sum;
}

std::string
flaws_of (GstElement *pipeline, const std::vector<GstElement *> &recorders,
    const std::vector<GstElement *> &hurried)
{
  constexpr struct {
    const char *counter, *text, *text_of_one = text;
  } kFlaws[] = {{"frames-lost", "lost"}, {"frames-corrupted", "corrupted"},
      {"frames-incomplete", "incomplete"}, {"frames-late", "late"},
      {"frames-duplicate", "duplicate"}, {"frames-skipped", "skipped"},
      {"slips", "losses of synchronisation", "loss of synchronisation"}};
  std::string text;
  for (const auto &[counter, text_of_many, text_of_one] : kFlaws) {
    guint64 most = 0;
    const bool loss = std::string_view (counter) == "frames-lost";
    if (loss && !recorders.empty ())
      most = counters_of (recorders, counter);
    else
      each_element (pipeline, [&] (GstElement *element) {
        if (!loss || !std::ranges::count (hurried, element))
          most = std::max (most, counter_of (element, counter));
      });
    if (most > 0)
      text += format (", %" G_GUINT64_FORMAT " %s", most,
          most == 1 ? text_of_one : text_of_many);
  }
  return text;
}

} // namespace codedexposure::app

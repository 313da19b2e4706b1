/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-subframestats
 * @title: subframestats
 * @short_description: Intensity, entropy and line profile of every picture
 *
 * Passes pictures on and measures each: mean, minimum and maximum of the pixel
 * values, entropy and histogram, the number of saturated pixels, and the values
 * along a line. It works behind every pad of codedexposure-demux, `src`,
 * `subframe_%u` or `coded`, and tells which subframe of which frame it
 * measured.
 *
 * Each picture gets the custom meta `CodedExposureStats`; with
 * #subframestats:post-messages the bus gets the same fields as the element
 * message `subframestats/stats`; with #subframestats:location they go to a file
 * as lines of JSON or CSV. docs/streams.md describes the fields.
 *
 * Entropy is the Shannon entropy of the pixel values, in bits a pixel, whatever
 * #subframestats:histogram-bins is. Noise and exposure raise it as texture
 * does.
 *
 * The numbers describe the picture as it was here: the meta stays on a picture
 * that is scaled or converted later.
 *
 * ## Example pipelines
 * |[
 * gst-launch-1.0 filesrc location=coded.mkv ! matroskademux ! avdec_ffv1 \
 *     ! codedexposure-demux name=demux ! queue \
 *     ! subframestats location=subframes.csv format=csv line=row:50% \
 *     ! fakesink demux.coded ! queue \
 *     ! subframestats location=coded.csv format=csv ! fakesink
 * ]|
 * |[
 * gst-launch-1.0 -m videotestsrc num-buffers=8 \
 *     ! video/x-raw,format=GRAY8,framerate=100/1 ! codedexposure-sim \
 *     ! codedexposure-demux \
 *     ! subframestats post-messages=true histogram-bins=8 ! fakesink
 * ]|
 *
 * Since: 0.1
 */
#include <optional>
#include <string>
#include <utility>

#include <gst/base/gstbasetransform.h>

#include "common/element.h"
#include "common/elements.h"
#include "common/lines.h"
#include "common/meta.h"
#include "common/record.h"
#include "common/stats_report.h"
#include "common/tag.h"

using namespace codedexposure;
using namespace codedexposure::gst;

GST_DEBUG_CATEGORY_STATIC (subframestats_debug);
#define GST_CAT_DEFAULT subframestats_debug

namespace
{

enum class Format { json, csv };

struct Settings {
  std::string location;
  Format format = Format::json;
  std::string line;
  int bits = 0;
  int bins = 256;
  bool post_messages = true;
};

struct StatsState {
  /* Object lock. */
  Settings settings;
  guint64 frames_in = 0;
  guint64 saturated_frames = 0;

  /* Streaming thread, and start and stop, which exclude it. */
  Settings in_force;
  StatsOptions options;
  GstVideoInfo info;
  int tagged_bits = 0;
  std::optional<StatsMeter> meter;
  LineFile file;
};

struct GstSubframeStats : Instance<GstBaseTransform, StatsState> {
};

G_DEFINE_ENUM_TYPE (GstSubframeStatsFormat, gst_subframe_stats_format,
    {int (Format::json), "Lines of JSON", "json"},
    {int (Format::csv), "Comma-separated values, with a head", "csv"});

PropertyTable<StatsState>
properties ()
{
  static const auto set = [] (auto member) {
    return within (&StatsState::settings, member);
  };
  return {
      {"location", "File location",
          "File to write, a line a picture; overwritten when it exists; empty: "
          "no file",
          kReadWriteReady, set (&Settings::location)},
      {"format", "File format", "What the lines of the file are",
          kReadWriteReady, set (&Settings::format),
          gst_subframe_stats_format_get_type ()},
      {"line", "Profile line",
          "Line whose values are the profile: row:Y, column:X or X0/Y0/X1/Y1, "
          "in pixels of the picture or in percent of it as in row:50%, which "
          "suit coded frames and subframes alike; empty: no profile",
          kReadWriteReady, set (&Settings::line)},
      {"bits", "Significant bits",
          "Significant bits of a pixel; their largest value is saturation. 0: "
          "as the frame metadata or the tags say, or all bits of the format",
          kReadWriteReady, set (&Settings::bits), 0, 16},
      {"histogram-bins", "Bins of the histogram",
          "Bins of the histogram, of equal width over all grey levels; 0: no "
          "histogram",
          kReadWriteReady, set (&Settings::bins), 0, 65536},
      {"post-messages", "Post messages",
          "Post the element message subframestats/stats for every picture",
          kReadWriteReady, set (&Settings::post_messages)},
      {"frames-in", "Pictures measured",
          "Pictures that were measured in this run", kReadOnly,
          &StatsState::frames_in, guint64 (0), guint64 (G_MAXINT64)},
      {"saturated-frames", "Saturated pictures",
          "Pictures with pixels at the largest value, in this run", kReadOnly,
          &StatsState::saturated_frames, guint64 (0), guint64 (G_MAXINT64)},
  };
}

bool
begin_run (GstElement *element)
{
  auto *self = as<GstSubframeStats> (element);
  StatsState &state = self->state;
  locked (self, [&] {
    state.in_force = state.settings;
    state.frames_in = state.saturated_frames = 0;
  });
  const Settings &settings = state.in_force;
  state.options = {settings.bits, settings.bins, {}};
  if (!settings.line.empty ()) {
    const auto line = ProfileLine::parse (settings.line);
    if (!line)
      return refuse_settings (
          self, "The line property cannot be read: " + line.error ().message);
    state.options.line = *line;
  }
  if (settings.location.empty ())
    return true;
  return state.file.open (self, settings.location) &&
         (settings.format != Format::csv || state.file.write (kCsvHead));
}

void
end_run (GstElement *element)
{
  StatsState &state = state_in<GstSubframeStats> (element);
  state.file.close ();
  state.meter.reset ();
}

bool
make_meter (GstSubframeStats *self)
{
  StatsState &state = self->state;
  state.meter.reset ();
  auto made = StatsMeter::make ({state.info.width, state.info.height},
      int (GST_VIDEO_INFO_COMP_DEPTH (&state.info, 0)), state.options);
  if (!made)
    return refuse_settings (
        self, "These pictures cannot be measured: " + made.error ().message);
  state.meter = *std::move (made);
  return true;
}

gboolean
set_caps (GstBaseTransform *base, GstCaps *caps, GstCaps *) noexcept
{
  auto *self = as<GstSubframeStats> (base);
  StatsState &state = self->state;
  if (!gst_video_info_from_caps (&state.info, caps))
    return FALSE;
  state.options.bits = state.in_force.bits;
  return make_meter (self);
}

/* Without the bits property, the metas set the significant bits; frames of a
 * file without a track have none, but tags. */
bool
follow_bits (GstSubframeStats *self, GstBuffer *frame)
{
  StatsState &state = self->state;
  const auto meta = get_frame_meta (frame);
  const int bits =
      significant_bits_of (meta ? meta->bits : state.tagged_bits, state.info);
  if (state.in_force.bits > 0 || bits == state.options.bits)
    return true;
  state.options.bits = bits;
  return make_meter (self);
}

gboolean
sink_event (GstBaseTransform *base, GstEvent *event) noexcept
{
  follow_tagged_bits (event, state_in<GstSubframeStats> (base).tagged_bits);
  return base_transform_class ()->sink_event (base, event);
}

/* The statistics of @frame; null, with an error posted, if it is too short. */
const PictureStats *
measure (GstSubframeStats *self, GstBuffer *frame)
{
  StatsState &state = self->state;
  MappedFrame mapped (state.info, frame, GST_MAP_READ);
  if (!mapped) {
    POST_ERROR (self, STREAM, FORMAT, unreadable_text (state.info, frame));
    return nullptr;
  }
  return read_pixels (
      mapped, [&] (auto pixels) { return &state.meter->measure (pixels); });
}

/* Counts the picture. Returns its number, for pictures without metadata. */
guint64
count (GstSubframeStats *self, bool saturated)
{
  const ObjectLock lock (self);
  self->state.saturated_frames += saturated;
  return self->state.frames_in++;
}

/* @frame: writable. */
GstFlowReturn
describe (GstSubframeStats *self, GstBuffer *frame)
{
  StatsState &state = self->state;
  const PictureStats *stats = measure (self, frame);
  if (!stats)
    return GST_FLOW_ERROR;
  const guint64 counted = count (self, stats->saturated > 0);
  const auto meta = get_frame_meta (frame);
  const GstClockTime pts = GST_BUFFER_PTS (frame);
  const StatsReport report{meta ? meta->frame : counted,
      meta ? meta->subframe : -1, pts,
      running_time (GST_BASE_TRANSFORM (self)->segment, pts),
      flag_names (frame), GST_BUFFER_DURATION (frame),
      meta ? meta->locked : std::nullopt, meta ? meta->lost_before : 0, *stats};

  const GstStructure *fields = set_stats_meta (frame, report);
  if (state.in_force.post_messages) {
    GstStructure *message = gst_structure_copy (fields);
    gst_structure_set_name (message, "subframestats/stats");
    gst_element_post_message (GST_ELEMENT (self),
        gst_message_new_element (GST_OBJECT (self), message));
  }
  const bool csv = state.in_force.format == Format::csv;
  if (state.file.is_open () &&
      !state.file.write (csv ? csv_line (report) : json_line (report)))
    return GST_FLOW_ERROR;
  return GST_FLOW_OK;
}

/* Pixels pass unchanged, but the buffer must be writable for its meta. */
GstFlowReturn
generate_output (GstBaseTransform *base, GstBuffer **outbuf) noexcept
{
  auto *self = as<GstSubframeStats> (base);
  if (!base->queued_buf)
    return GST_FLOW_OK;
  BufferPtr frame (
      gst_buffer_make_writable (std::exchange (base->queued_buf, nullptr)));
  if (!self->state.meter)
    return GST_FLOW_NOT_NEGOTIATED;
  if (!follow_bits (self, frame.get ()))
    return GST_FLOW_ERROR;
  const GstFlowReturn flow = describe (self, frame.get ());
  if (flow == GST_FLOW_OK)
    *outbuf = frame.release ();
  return flow;
}

constexpr StateHooks kRun{.begin = begin_run, .end = end_run};

void
set_up (gpointer klass)
{
  GST_DEBUG_CATEGORY_INIT (
      subframestats_debug, "subframestats", 0, "statistics of subframes");
  install_state<GstSubframeStats, properties> (klass);
  install_run<kRun> (klass);
  describe_element (klass, "Subframe statistics", "Filter/Analyzer/Video",
      "Measures intensity, entropy, histogram and a line profile of every "
      "picture");

  auto *transform_class = GST_BASE_TRANSFORM_CLASS (klass);
  transform_class->set_caps = GST_DEBUG_FUNCPTR (set_caps);
  transform_class->sink_event = GST_DEBUG_FUNCPTR (sink_event);
  transform_class->generate_output = GST_DEBUG_FUNCPTR (generate_output);
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (subframestats, "subframestats", GST_RANK_NONE,
    (type_of<GstSubframeStats, set_up, set_up_passing> (
        "GstSubframeStats", GST_TYPE_BASE_TRANSFORM)))

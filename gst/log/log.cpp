/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-log
 * @title: codedexposure-log
 *
 * Passes coded frames on and writes one line of JSON for each to a file:
 * number, time, exposure, synchronisation and lost frames. A recording keeps
 * the pixels and the schedule, but not the frames' metadata; this file keeps
 * them.
 *
 * The first line is the schedule in its JSON form; the second is the mapping,
 * if there is one. With them a recording that ended before its tags were
 * written can still be decoded. Each line goes to the system at once: a crash
 * loses one line at most.
 *
 * ## Example pipeline
 * |[
 * gst-launch-1.0 -e videotestsrc num-buffers=100 !
 * video/x-raw,format=GRAY8,framerate=100/1 ! codedexposure-sim !
 * codedexposure-log location=coded.jsonl ! avenc_ffv1 ! matroskamux
 * timecodescale=1000 ! filesink location=coded.mkv
 * ]|
 *
 * Since: 0.1
 */
#include <algorithm>
#include <optional>
#include <string>

#include <gst/base/gstbasetransform.h>
#include <nlohmann/json.hpp>

#include "common/element.h"
#include "common/elements.h"
#include "common/lines.h"
#include "common/meta.h"
#include "common/tag.h"
#include "extract/saturation.h"

using namespace codedexposure::gst;

GST_DEBUG_CATEGORY_STATIC (codedexposure_log_debug);
#define GST_CAT_DEFAULT codedexposure_log_debug

namespace
{

struct LogState {
  std::string location; // object lock
  /* Streaming thread, and start and stop, which exclude it: */
  LineFile file;
  guint64 frames = 0;
  GstVideoInfo info = {};
  /* As last written. */
  std::optional<codedexposure::Schedule> schedule;
  std::optional<codedexposure::Mapping> mapping;
};

/** Pixels of a coded frame at the largest value, without the pilot's. Those of
 * a subframe were counted when it was extracted. */
std::optional<guint64>
saturated_pixels (
    const LogState &state, GstBuffer *frame, const FrameMeta &meta)
{
  if (meta.subframe >= 0)
    return meta.saturated;
  MappedFrame mapped (state.info, frame, GST_MAP_READ);
  if (!mapped)
    return std::nullopt;
  const int pilot = state.schedule ? state.schedule->pilot_rows () : 0;
  return read_pixels (mapped, [&] (auto pixels) {
    return codedexposure::count_saturated (
        pixels.rows (0, std::max (0, pixels.height - pilot)),
        significant_bits_of (meta.bits, state.info));
  });
}

/** One line of JSON, keys in this order; unknown values are left out, except
 * `locked`, which is null then. */
std::string
frame_line (const LogState &state, GstBuffer *frame, const GstSegment &segment)
{
  const auto meta = get_frame_meta (frame);
  const auto set_time = [&segment] (nlohmann::ordered_json &line,
                            const char *key, GstClockTime time) {
    const GstClockTime running = running_time (segment, time);
    if (GST_CLOCK_TIME_IS_VALID (running))
      line[key] = running;
  };

  nlohmann::ordered_json line;
  line["frame"] = meta ? meta->frame : state.frames;
  set_time (line, "pts_ns", GST_BUFFER_PTS (frame));
  if (meta) {
    set_time (line, "exposure_start_ns", meta->exposure_start);
    if (GST_CLOCK_TIME_IS_VALID (meta->exposure_duration))
      line["exposure_duration_ns"] = meta->exposure_duration;
    if (GST_CLOCK_TIME_IS_VALID (meta->time_uncertainty))
      line["time_uncertainty_ns"] = meta->time_uncertainty;
    line["locked"] =
        meta->locked ? nlohmann::json (*meta->locked) : nlohmann::json ();
    line["slip"] = meta->slip;
    line["lost_before"] = meta->lost_before;
    if (const auto saturated = saturated_pixels (state, frame, *meta))
      line["saturated"] = *saturated;
    if (!meta->pattern.empty ())
      line["pattern"] = meta->pattern;
    if (meta->bits > 0)
      line["bits"] = meta->bits;
  }
  line["flags"] = flag_names (frame);
  return line.dump ();
}

} // namespace

G_DECLARE_FINAL_TYPE (GstCodedExposureLog, gst_coded_exposure_log, GST,
    CODED_EXPOSURE_LOG, GstBaseTransform)

struct _GstCodedExposureLog {
  GstBaseTransform parent;
  LogState *state;
};

G_DEFINE_TYPE_WITH_CODE (GstCodedExposureLog, gst_coded_exposure_log,
    GST_TYPE_BASE_TRANSFORM,
    GST_DEBUG_CATEGORY_INIT (codedexposure_log_debug, "codedexposure-log", 0,
        "per-frame record of coded frames"))
GST_ELEMENT_REGISTER_DEFINE (codedexposure_log, "codedexposure-log",
    GST_RANK_NONE, gst_coded_exposure_log_get_type ())

namespace
{

GstFlowReturn
transform_ip (GstBaseTransform *base, GstBuffer *frame) noexcept
{
  LogState &state = state_in<GstCodedExposureLog> (base);
  const std::string line = frame_line (state, frame, base->segment);
  state.frames++;
  return state.file.write (line) ? GST_FLOW_OK : GST_FLOW_ERROR;
}

gboolean
set_caps (GstBaseTransform *base, GstCaps *caps, GstCaps *)
{
  LogState &state = state_in<GstCodedExposureLog> (base);
  return gst_video_info_from_caps (&state.info, caps);
}

/* Upstream repeats tags; each schedule and mapping is written once. */
void
note_setup (GstCodedExposureLog *self, GstEvent *event)
{
  LogState &state = *self->state;
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event, &tags);
  const auto setup = setup_from_tags (tags);
  if (!setup)
    return;
  if (!*setup) {
    POST_WARNING (self, STREAM, DECODE,
        "The schedule of the stream is not recorded: " +
            setup->error ().message);
    return;
  }
  const codedexposure::StreamSetup &said = setup->value ();
  if (!(state.schedule == said.schedule)) {
    state.schedule = said.schedule;
    state.file.write (state.schedule->to_json ());
  }
  if (said.mapping && !(state.mapping == said.mapping)) {
    state.mapping = said.mapping;
    state.file.write (state.mapping->to_json ());
  }
}

gboolean
sink_event (GstBaseTransform *base, GstEvent *event) noexcept
{
  if (GST_EVENT_TYPE (event) == GST_EVENT_TAG)
    note_setup (GST_CODED_EXPOSURE_LOG (base), event);
  return GST_BASE_TRANSFORM_CLASS (gst_coded_exposure_log_parent_class)
      ->sink_event (base, event);
}

bool
begin_run (GstElement *element)
{
  auto *self = GST_CODED_EXPOSURE_LOG (element);
  LogState &state = *self->state;
  std::string location;
  {
    const ObjectLock lock (self);
    location = state.location;
  }
  state.frames = 0;
  state.schedule.reset ();
  state.mapping.reset ();
  if (location.empty ()) {
    POST_ERROR (self, RESOURCE, NOT_FOUND,
        "codedexposure-log has no file to write to: set location=FILE.jsonl");
    return false;
  }
  return state.file.open (self, location);
}

void
end_run (GstElement *element)
{
  state_in<GstCodedExposureLog> (element).file.close ();
}

const PropertyTable<LogState> &
properties ()
{
  static const PropertyTable<LogState> table{{"location", "File location",
      "File to write, one line of JSON a coded frame; overwritten when it "
      "exists",
      kReadWriteReady, &LogState::location}};
  return table;
}

} // namespace

static void
gst_coded_exposure_log_init (GstCodedExposureLog *self)
{
  self->state = new LogState;
  gst_base_transform_set_passthrough (GST_BASE_TRANSFORM (self), TRUE);
}

static void
gst_coded_exposure_log_class_init (GstCodedExposureLogClass *klass)
{
  install_state<GstCodedExposureLog, properties> (klass);
  install_run<begin_run, end_run> (klass);
  describe_element (klass, "Coded exposure frame log", "Filter/Analyzer/Video",
      "Writes what is known of every coded frame to a file of JSON lines");

  auto *transform_class = GST_BASE_TRANSFORM_CLASS (klass);
  transform_class->set_caps = GST_DEBUG_FUNCPTR (set_caps);
  transform_class->sink_event = GST_DEBUG_FUNCPTR (sink_event);
  transform_class->transform_ip = GST_DEBUG_FUNCPTR (transform_ip);
}

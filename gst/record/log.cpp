/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The part of codedexposure-recordmux that knows frames: passes them on and
 * writes a line of JSON for each, to the pad `track` as text with the PTS and
 * DURATION of its frame, and to a file. Lines name their setup (schedule,
 * mapping, bench profile) by a hash, and hold it: each line if it takes at most
 * 512 bytes; else the first two lines, one after each change, and one a second.
 * The last line says that the recording is complete. With the pad `track`, the
 * tag with the schedule says that a track accompanies the frames, and has all
 * setups of before. */
#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gst/base/gstbasetransform.h>

#include "common/element.h"
#include "common/lines.h"
#include "common/partner.h"
#include "common/record.h"
#include "common/tag.h"
#include "partner_output.h"
#include "parts.h"
#include "record/track.h"
#include "segment.h"

using namespace codedexposure;
using namespace codedexposure::gst;

GST_DEBUG_CATEGORY_STATIC (codedexposure_log_debug);
#define GST_CAT_DEFAULT codedexposure_log_debug

namespace
{

/** What a flush begins anew. Streaming thread, and start and stop, which
 * exclude it. */
struct Written {
  guint64 frames = 0;
  std::optional<guint64> last; ///< largest number of a frame with a meta
  std::set<guint64> missing;   ///< numbers that were counted as lost
  /** As last written to the file. */
  std::optional<Schedule> schedule;
  std::optional<Mapping> mapping;
  std::optional<BenchProfile> bench;
  /** As last written to the track, and the PTS of that frame. */
  std::optional<StreamSetup> tracked;
  GstClockTime tracked_at = GST_CLOCK_TIME_NONE;
};

struct LogState : Written {
  /* Object lock: */
  std::string location;
  guint64 frames_lost = 0; ///< since the first
  /* As above: */
  LineFile file;
  GstPad *track = nullptr; ///< the element's
  PartnerOutput partners;
  bool stream_sent = false; ///< to the track
  bool segment_sent = false;
  GstVideoInfo info = {};
  bool is_raw = true;   ///< frames are pixels, which @c info describes
  GstClockTime end = 0; ///< of the last frame
  /** Of the stream. */
  std::optional<StreamSetup> setup;
  guint64 setup_id = 0;
  std::vector<StreamSetup> setups; ///< all, the last one last
  bool setup_is_short = false;     ///< each line can have it
  bool said_partner = false;
};

struct GstCodedExposureLog : Instance<GstBaseTransform, LogState> {
};

/* Receivers that join late, segments, and recordings of which a part is damaged
 * need it again. */
constexpr GstClockTime kRepeat = GST_SECOND;

bool
has_track (const LogState &state)
{
  return gst_pad_is_linked (state.track);
}

/** The next text belongs to another segment, or another stream. */
void
restart_track (LogState &state, bool stream)
{
  state.segment_sent = false;
  state.stream_sent &= !stream;
}

/** Text that belongs to the segment of the frames. */
GstFlowReturn
push_text (GstCodedExposureLog *self, const std::string &text, GstClockTime pts,
    GstClockTime duration)
{
  LogState &state = self->state;
  GstPad *track = state.track;
  if (!has_track (state))
    return GST_FLOW_OK;
  if (!std::exchange (state.stream_sent, true)) {
    const CharPtr id (
        gst_pad_create_stream_id (track, GST_ELEMENT (self), "track"));
    GstEvent *stream = gst_event_new_stream_start (id.get ());
    gst_event_set_stream_flags (stream, GST_STREAM_FLAG_SPARSE);
    gst_pad_push_event (track, stream);
    const CapsPtr caps (gst_pad_get_pad_template_caps (track));
    gst_pad_push_event (track, gst_event_new_caps (caps.get ()));
  }
  if (!std::exchange (state.segment_sent, true))
    gst_pad_push_event (
        track, gst_event_new_segment (&GST_BASE_TRANSFORM (self)->segment));
  GstBuffer *buffer = gst_buffer_new_memdup (text.data (), text.size ());
  GST_BUFFER_PTS (buffer) = pts;
  GST_BUFFER_DURATION (buffer) = duration;
  const GstFlowReturn flow = gst_pad_push (track, buffer);
  return flow == GST_FLOW_NOT_LINKED ? GST_FLOW_OK : flow;
}

/** Whether the line of a frame at @p pts holds the setup. */
bool
repeats_setup (const LogState &state, GstClockTime pts)
{
  return state.setup &&
         (state.setup_is_short || state.frames <= 2 ||
             !(state.tracked == state.setup) || pts < state.tracked_at ||
             pts - state.tracked_at >= kRepeat);
}

/** How long a frame lasts. */
GstClockTime
duration_of (const LogState &state, GstBuffer *frame)
{
  if (GST_BUFFER_DURATION_IS_VALID (frame))
    return GST_BUFFER_DURATION (frame);
  return state.info.fps_n > 0 ? gst_util_uint64_scale_int (GST_SECOND,
                                    state.info.fps_d, state.info.fps_n)
                              : GST_CLOCK_TIME_NONE;
}

GstFlowReturn
push_line (GstCodedExposureLog *self, GstBuffer *frame, FrameRecord record)
{
  LogState &state = self->state;
  const GstClockTime pts = GST_BUFFER_PTS (frame);
  if (!GST_CLOCK_TIME_IS_VALID (pts)) {
    POST_ERROR (self, STREAM, FORMAT,
        "A coded frame has no time stamp (PTS), so its line could not be found "
        "again. Let the source set one, for example with do-timestamp=true.");
    return GST_FLOW_ERROR;
  }
  TrackLine line{.frame = std::move (record)};
  if (state.setup)
    line.setup_id = state.setup_id;
  if (repeats_setup (state, pts)) {
    line.setup = state.tracked = state.setup;
    state.tracked_at = pts;
  }
  const GstClockTime duration = duration_of (state, frame);
  state.end = GST_CLOCK_TIME_IS_VALID (duration) ? pts + duration : pts;
  return push_text (self, line.to_json (), pts, duration);
}

/** Whether the frame was counted as lost before. */
bool
comes_late (LogState &state, const FrameRecord &record)
{
  constexpr guint64 kMost = 1000; // no frame is later
  const bool is_late = state.missing.erase (record.frame) > 0;
  for (guint64 k = std::min (*record.lost_before, kMost); k > 0; k--)
    state.missing.insert (record.frame - std::min (record.frame, k));
  while (state.missing.size () > kMost)
    state.missing.erase (state.missing.begin ());
  return is_late;
}

/* Also those that a queue dropped between the element that numbers the frames
 * and this one. */
void
count_lost (GstCodedExposureLog *self, FrameRecord &record)
{
  LogState &state = self->state;
  if (!record.lost_before) // without a meta, the number is a count
    return;
  const bool is_new = state.last != record.frame; // no further subframe
  if (state.last && record.frame > *state.last)
    record.lost_before =
        std::max (*record.lost_before, record.frame - *state.last - 1);
  state.last = std::max<guint64> (record.frame, state.last.value_or (0));
  if (!is_new)
    return;
  const ObjectLock lock (self);
  state.frames_lost += *record.lost_before;
  state.frames_lost -= comes_late (state, record) ? 1 : 0;
}

/* The encoder would give it the time of the segment, and the muxer drop its
 * line. */
bool
begins_before (const GstSegment &segment, GstBuffer *frame)
{
  return GST_BUFFER_PTS_IS_VALID (frame) &&
         !GST_CLOCK_TIME_IS_VALID (
             running_time (segment, GST_BUFFER_PTS (frame)));
}

GstFlowReturn
transform_ip (GstBaseTransform *base, GstBuffer *frame) noexcept
{
  auto *self = as<GstCodedExposureLog> (base);
  LogState &state = self->state;
  if (state.is_raw && !holds_frame (base, state.info, frame))
    return GST_FLOW_ERROR;
  if (base->segment.rate < 0 || base->segment.format != GST_FORMAT_TIME)
    return GST_FLOW_ERROR;
  if (begins_before (base->segment, frame))
    return GST_BASE_TRANSFORM_FLOW_DROPPED;
  const int pilot = state.setup ? state.setup->schedule.pilot_rows () : 0;
  FrameRecord record =
      record_of (frame, state.info, base->segment, pilot, state.frames++);
  if (const auto time = record.too_far ()) {
    POST_ERROR (self, STREAM, FORMAT, too_far_text (GstClockTime (*time)));
    return GST_FLOW_ERROR;
  }
  count_lost (self, record);
  if (state.file.is_open () && !state.file.write (record.to_json ()))
    return GST_FLOW_ERROR;
  const GstFlowReturn flow = has_track (state)
                                 ? push_line (self, frame, std::move (record))
                                 : GST_FLOW_OK;
  if (flow != GST_FLOW_OK)
    return flow;
  const bool records_partners = state.partners.is_linked ();
  const guint64 lost = records_partners ? state.partners.lost_before (frame)
                                        : get_partner (frame).has_value ();
  locked (self, [&] { return state.frames_lost += lost; });
  if (!records_partners)
    return GST_FLOW_OK;
  const CapsPtr caps (gst_pad_get_current_caps (base->sinkpad));
  return state.partners.push (
      GST_ELEMENT (self), frame, caps.get (), base->segment);
}

gboolean
set_caps (GstBaseTransform *base, GstCaps *caps, GstCaps *)
{
  LogState &state = state_in<GstCodedExposureLog> (base);
  state.is_raw = !is_encoded (caps);
  state.info = {};
  return !state.is_raw || gst_video_info_from_caps (&state.info, caps);
}

/* Upstream repeats tags; the file holds each schedule, mapping and bench
 * profile once. */
void
note_setup (LogState &state, const StreamSetup &setup)
{
  constexpr std::size_t kShort = 512;
  state.setup = setup;
  state.setup_id = id_of (setup);
  state.setup_is_short = state.setup->to_json ().size () <= kShort;
  std::erase (state.setups, setup);
  state.setups.push_back (setup);
  if (!state.file.is_open ())
    return;
  const auto write_once = [&state] (auto &written, const auto &value) {
    if (value && !(written == value))
      state.file.write ((written = value)->to_json ());
  };
  write_once (state.schedule, std::optional (state.setup->schedule));
  write_once (state.mapping, state.setup->mapping);
  write_once (state.bench, state.setup->bench);
}

/* The tags that go on say whether there is a track, where its own lines need
 * not. Transfer: full, of both. */
GstEvent *
take_tags (GstCodedExposureLog *self, GstEvent *event)
{
  LogState &state = self->state;
  GstTagList *tags = tags_of (event);
  const auto read = setup_from_tags (tags);
  if (!read)
    return event;
  if (!*read) {
    POST_WARNING (self, STREAM, DECODE,
        "The schedule of the stream is not recorded: " +
            read->error ().message);
    return event;
  }
  StreamSetup setup = read->value ();
  if (setup.partner && state.partners.is_linked ()) {
    state.partners.set_setup (setup);
  } else if (setup.partner) {
    if (!std::exchange (state.said_partner, true))
      POST_WARNING (self, STREAM, FORMAT,
          "The second camera came after the first frame, so that its frames "
          "are not recorded, only those of the first one. Start both cameras "
          "before the trigger.");
    setup.partner.reset ();
    event = replace_setup (event, setup);
  }
  setup.track = false;
  note_setup (state, setup);
  if (!has_track (state))
    return event;
  setup.track = true;
  return add_setups (replace_setup (event, setup), state.setups);
}

/* The last line proves that no frame after it is missing. */
void
end_track (GstCodedExposureLog *self)
{
  LogState &state = self->state;
  if (state.frames > 0)
    push_text (self, TrackLine{.end = state.frames}.to_json (), state.end,
        GST_MSECOND);
}

/* What was written before a flush does not count. */
bool
begin_anew (GstCodedExposureLog *self)
{
  LogState &state = self->state;
  const std::string location = locked (self, [&] {
    state.frames_lost = 0;
    return state.location;
  });
  static_cast<Written &> (state) = {};
  const bool has_file = location.empty () || state.file.open (self, location);
  if (has_file && state.setup)
    note_setup (state, StreamSetup (*state.setup));
  return has_file;
}

/* The last frame may end after the segment, and the last line is behind it. All
 * that comes is recorded. Transfer: full, of both. */
GstEvent *
open_end (GstCodedExposureLog *self, GstEvent *event)
{
  GstSegment segment = *segment_of (event);
  if (!counts_time (self, segment))
    return event;
  if (segment.rate < 0) {
    POST_ERROR (self, STREAM, FORMAT,
        "The frames come backwards, but a recording has them in the order of "
        "time. Record them while they are played forwards.");
    return event;
  }
  segment.stop = GST_CLOCK_TIME_NONE;
  EventPtr open = segment_event (segment, gst_event_get_seqnum (event));
  gst_event_unref (event);
  return open.release ();
}

gboolean
sink_event (GstBaseTransform *base, GstEvent *event) noexcept
{
  auto *self = as<GstCodedExposureLog> (base);
  LogState &state = self->state;
  if (state.partners.is_linked ())
    state.partners.follow (event);
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_TAG:
    event = take_tags (self, event);
    break;
  case GST_EVENT_STREAM_START:
    restart_track (state, true);
    break;
  case GST_EVENT_SEGMENT:
    restart_track (state, false);
    event = open_end (self, event);
    break;
  case GST_EVENT_FLUSH_STOP:
    begin_anew (self);
    gst_pad_push_event (state.track, gst_event_ref (event));
    break;
  case GST_EVENT_EOS:
    end_track (self);
    [[fallthrough]];
  case GST_EVENT_FLUSH_START:
    gst_pad_push_event (state.track, gst_event_ref (event));
    break;
  case GST_EVENT_GAP:
    if (base->segment.format == GST_FORMAT_TIME)
      break;
    gst_event_unref (event);
    return TRUE;
  default:
    break;
  }
  return base_transform_class ()->sink_event (base, event);
}

bool
begin_run (GstElement *element)
{
  auto *self = as<GstCodedExposureLog> (element);
  LogState &state = self->state;
  state.setup.reset ();
  state.setups.clear ();
  state.said_partner = false;
  state.partners.restart ();
  restart_track (state, true);
  if (!begin_anew (self))
    return false;
  if (has_track (state) || state.file.is_open ())
    return true;
  POST_ERROR (self, RESOURCE, NOT_FOUND, "There is nothing to write to");
  return false;
}

void
end_run (GstElement *element)
{
  state_in<GstCodedExposureLog> (element).file.close ();
}

StructurePtr
stats_of (const LogState &state)
{
  return StructurePtr (
      gst_structure_new ("application/x-codedexposure-log-counters",
          "frames-lost", G_TYPE_UINT64, state.frames_lost, nullptr));
}

PropertyTable<LogState>
properties ()
{
  return {
      {"location", "File location",
          "File to write, one line of JSON a coded frame; overwritten when it "
          "exists; empty: none",
          kReadWriteReady, &LogState::location},
      {"counters", "Statistics", "Those of codedexposure-recordmux", kReadOnly,
          stats_of}};
}

constexpr StateHooks kRun{.begin = begin_run, .end = end_run};

/* It has one, `partner`. */
GstPad *
request_new_pad (
    GstElement *self, GstPadTemplate *, const gchar *, const GstCaps *) noexcept
{
  GstPad *pad = add_pad (self, "partner");
  gst_pad_use_fixed_caps (pad);
  state_in<GstCodedExposureLog> (self).partners.take_over (pad);
  return pad;
}

void
set_up (gpointer klass)
{
  GST_DEBUG_CATEGORY_INIT (codedexposure_log_debug, "codedexposure-log", 0,
      "per-frame record of coded frames");
  install_state<GstCodedExposureLog, properties> (klass);
  install_run<kRun> (klass);
  describe_element (klass, "Coded exposure frame log", "Filter/Analyzer/Video",
      "Writes what is known of every coded frame: as a text track for a "
      "container, or to a file of JSON lines",
      {});
  add_part_templates (klass);
  add_pad_template (klass, "track", {.caps = "text/x-raw,format=utf8"});
  add_pad_template (
      klass, "partner", {.presence = GST_PAD_REQUEST, .caps = kPartCaps});
  GST_ELEMENT_CLASS (klass)->request_new_pad = request_new_pad;

  auto *transform_class = GST_BASE_TRANSFORM_CLASS (klass);
  transform_class->set_caps = GST_DEBUG_FUNCPTR (set_caps);
  transform_class->sink_event = GST_DEBUG_FUNCPTR (sink_event);
  transform_class->transform_ip = GST_DEBUG_FUNCPTR (transform_ip);
}

void
set_up_instance (GstCodedExposureLog *self)
{
  gst_base_transform_set_passthrough (GST_BASE_TRANSFORM (self), TRUE);
  self->state.track = add_pad (GST_ELEMENT (self), "track");
  gst_pad_use_fixed_caps (self->state.track);
}

} // namespace

GType
gst_coded_exposure_log_get_type ()
{
  return type_of<GstCodedExposureLog, set_up, set_up_instance> (
      "GstCodedExposureLog", GST_TYPE_BASE_TRANSFORM);
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The part of codedexposure-recorddemux that knows frames: puts back onto them
 * what their track says, and checks their pixels. The pad `track` takes the
 * text directly from the demuxer, without a queue. A frame is held until the
 * next one comes if its line is not there yet. The pad `partner` takes the
 * frames of the second camera from another such part. */
#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include <gst/gst.h>

#include "common/element.h"
#include "common/events.h"
#include "common/meta.h"
#include "common/record.h"
#include "common/tag.h"
#include "parts.h"
#include "restore.h"

using namespace codedexposure;
using namespace codedexposure::gst;

GST_DEBUG_CATEGORY (codedexposure_restore_debug);
#define GST_CAT_DEFAULT codedexposure_restore_debug

namespace
{

struct GstCodedExposureRestore : Instance<GstElement, RestoreState> {
};
using Self = GstCodedExposureRestore;

/* ---------------------------------------------------------------- setups -- */

/* The schedule of the track is in force; @said is that of the container. */
void
warn_if_different (Self *self, const StreamSetup &said)
{
  RestoreState &state = self->state;
  const auto &others = state.others;
  if (!state.setup || said.schedule == state.setup->schedule ||
      std::ranges::find (others, *state.setup) != others.end () ||
      std::exchange (state.said_setups_differ, true))
    return;
  POST_WARNING (self, STREAM, FORMAT,
      "The tags of the recording have the schedule " + said.schedule.text () +
          ", but its frames were recorded with " +
          state.setup->schedule.text () +
          ", as their track says, which is used. To use another, set the "
          "schedule property (or --schedule) where they are decoded.");
}

void
use_setup (Self *self, std::shared_ptr<const StreamSetup> setup)
{
  RestoreState &state = self->state;
  if (state.setup == setup || (state.setup && *state.setup == *setup))
    return;
  state.setup = std::move (setup);
  gst_pad_push_event (state.src, setup_to_event (*state.setup));
}

/* Before the frame to which the line, if it was found, belongs. */
void
settle_setup (Self *self, const TrackReader::Match &match)
{
  RestoreState &state = self->state;
  if (match.setup)
    use_setup (self, match.setup);
  else if (!state.setup && state.container)
    use_setup (self, std::make_shared<const StreamSetup> (*state.container));
  if (state.container)
    warn_if_different (self, *state.container);
}

void
note_setups (
    RestoreState &state, const StreamSetup &last, const GstTagList *tags)
{
  state.container = last;
  state.container->track = false;
  state.others = setups_from_tags (tags);
  state.track.read ([&state] (TrackReader &reader) {
    reader.know (*state.container);
    for (const StreamSetup &other : state.others)
      reader.know (other);
  });
}

/* With a track, tags pass without their setup, which the track has. */
gboolean
on_tag (Self *self, EventPtr event)
{
  RestoreState &state = self->state;
  GstTagList *tags = tags_of (event.get ());
  const auto said = setup_from_tags (tags);
  if (said && *said)
    state.announced |= said->value ().track;
  if (!said || !*said || !state.track.is_linked ())
    return gst_pad_push_event (state.src, event.release ());
  note_setups (state, said->value (), tags);
  warn_if_different (self, *state.container);
  GstEvent *rest = state.setup ? replace_setup (event.release (), *state.setup)
                               : remove_setup_and_provenance (event.release ());
  return !rest || gst_pad_push_event (state.src, rest);
}

/* ---------------------------------------------------------------- frames -- */

void
report_missing (RestoreState &state, const TrackReader::Match &match)
{
  if (!state.is_unwanted)
    state.damage.frames_missing (
        match.skipped, GstClockTime (match.skipped_from));
}

/* A frame without a line: nothing shows that it is as it was recorded. Without
 * a track, elements downstream number the frames by their times. */
void
mark_unknown (RestoreState &state, GstBuffer *frame)
{
  const bool has_track = state.track.is_linked ();
  std::optional<guint64> number;
  if (state.last_frame)
    number = *state.last_frame + 1;
  else if (GST_BUFFER_PTS_IS_VALID (frame))
    number = state.track.read ([frame] (const TrackReader &reader) {
      return reader.number_at (Nanoseconds (GST_BUFFER_PTS (frame)));
    });
  if (!number && state.whole)
    number = 0;
  if (has_track)
    set_frame_meta (frame, {.frame = number.value_or (0)});
  state.last_frame = number;
  GST_BUFFER_FLAG_SET (frame, GST_BUFFER_FLAG_CORRUPTED);
  state.damage.frame_flagged (false, number, GST_BUFFER_PTS (frame),
      !has_track                        ? "its track is missing"
      : GST_BUFFER_PTS_IS_VALID (frame) ? "the track has no line for it"
                                        : "it has no time to find its line by");
}

void
say_no_track (Self *self)
{
  RestoreState &state = self->state;
  if (std::exchange (state.said_no_track, true))
    return;
  if (state.announced)
    POST_WARNING (self, STREAM, DECODE,
        "The recording has a track, as its tags say, but no line of it can be "
        "read: it is damaged, or was copied without its track. It is unknown "
        "whether its frames are synchronised or damaged; all are flagged. Use "
        "another copy, with all tracks.");
  else
    POST_WARNING (self, STREAM, FORMAT,
        "The stream has no track: it is unknown whether its frames are "
        "synchronised or damaged. codedexposure-recordmux writes a track when "
        "it records.");
}

/* Remuxing moves all frames alike; so does damage to the first times. */
void
say_moved (Self *self, const TrackReader::Match &match)
{
  if (match.offset == 0 || match.misplaced ||
      std::exchange (self->state.said_moved, true))
    return;
  POST_INFO (self, STREAM, FORMAT,
      "The frames are " + time_text (std::abs (match.offset)) +
          (match.offset > 0 ? " later" : " earlier") +
          " than when they were recorded: the recording was given other times, "
          "or its first times are damaged.");
}

/* A part of the file stands in the place of another. A frame that came late
 * when it was recorded says so. */
bool
is_repeated (const RestoreState &state, const TrackReader::Match &match)
{
  const FrameRecord &record = *match.line->frame;
  return state.is_complete && state.last_frame && record.pts &&
         record.frame <= *state.last_frame &&
         *record.pts + match.offset <= Nanoseconds (state.last_pts) &&
         std::ranges::find (record.flags, "discont") == record.flags.end ();
}

/* Why the frame must not be used as it is; null: it can be. */
const char *
flaw_of (const RestoreState &state, GstBuffer *frame,
    const TrackReader::Match &match)
{
  const FrameRecord &record = *match.line->frame;
  if (record.hash && !state.encoded &&
      record.hash != hash_of (frame, state.info))
    return "its pixels are not those that were recorded";
  if (is_repeated (state, match))
    return "it repeats one that came before";
  if (match.misplaced)
    return "its time is not that at which it was recorded";
  if (match.names_unknown_setup)
    return "its schedule is not known, because a part of the track is missing";
  return nullptr;
}

/* Frames that are missing together with their lines, by the numbers. */
guint64
gap_before (const RestoreState &state, const FrameRecord &record)
{
  if (!state.is_complete || !state.last_frame ||
      record.frame <= *state.last_frame)
    return 0;
  return record.frame - *state.last_frame - 1;
}

void
restore (Self *self, GstBuffer *frame, const TrackReader::Match &match)
{
  RestoreState &state = self->state;
  FrameRecord record = *match.line->frame;
  const char *flaw = flaw_of (state, frame, match);
  if (flaw)
    record.hash.reset ();
  if (match.skipped > 0)
    record.lost_before = record.lost_before.value_or (0) + match.skipped;
  const guint64 gap = gap_before (state, record);
  if (gap > 0)
    record.lost_before = std::max (gap, record.lost_before.value_or (0));
  /* A demuxer sets it after each seek. */
  GST_BUFFER_FLAG_UNSET (frame, GST_BUFFER_FLAG_DISCONT);
  apply_record (frame, record, match.offset);
  /* Those of a whole recording are counted at its end. */
  const guint64 lost = match.line->frame->lost_before.value_or (0);
  if (!state.whole && match.skipped == 0 && gap > lost)
    state.damage.frames_missing_between (state.last_pts, GST_BUFFER_PTS (frame),
        gap - lost, state.segment, state.segment_seqnum);
  if (record.hash && state.encoded)
    carry_hash (frame, *record.hash);
  if (state.last_frame && record.frame > *state.last_frame)
    state.damage.frames_lost (*match.line->frame, GST_BUFFER_PTS (frame),
        state.segment, state.segment_seqnum);
  if (match.skipped > 0 || gap > 0)
    GST_BUFFER_FLAG_SET (frame, GST_BUFFER_FLAG_DISCONT);
  if (is_repeated (state, match))
    state.damage.frame_repeated ();
  if (!state.is_complete || !state.last_frame ||
      GST_BUFFER_PTS (frame) > state.last_pts)
    state.last_pts = GST_BUFFER_PTS (frame);
  state.last_frame = std::max (record.frame, state.last_frame.value_or (0));
  if (!std::exchange (state.found_line, true))
    gst_pad_push_event (
        state.src, gst_event_new_custom (GST_EVENT_CUSTOM_DOWNSTREAM_STICKY,
                       gst_structure_new_empty (kRecordedEvent)));
  say_moved (self, match);
  if (!flaw) {
    state.damage.end_sequence ();
    return;
  }
  GST_BUFFER_FLAG_SET (frame, GST_BUFFER_FLAG_CORRUPTED);
  state.damage.frame_flagged (true, record.frame, GST_BUFFER_PTS (frame), flaw);
}

/* ---------------------------------------------------------------- events -- */

void
check_end (Self *self)
{
  RestoreState &state = self->state;
  state.damage.end_sequence ();
  if (state.announced && state.last_frame && !state.found_line)
    say_no_track (self);
  if (!state.track.is_linked () || !state.is_complete || state.is_unwanted)
    return;
  const bool is_part = !state.whole && ends_early (state.sink, state.segment);
  const auto [rest, frames] = state.track.read ([&] (TrackReader &reader) {
    const auto start = Nanoseconds (state.segment.start);
    auto match = is_part && !reader.frames ()
                     ? reader.take_rest (start,
                           end_of_part (state.segment, state.segment_seqnum))
                     : reader.take_rest (start);
    return std::pair (std::move (match), reader.frames ());
  });
  report_missing (state, rest);
  if (!frames && is_part)
    return;
  if (!frames)
    state.damage.stream_cut ();
  else if (state.whole)
    state.damage.stream_ended (*frames);
}

void
forget_frames (RestoreState &state)
{
  state.held = {};
  state.last_frame.reset ();
  state.damage.forget ();
  state.track.forget ();
  state.partners.forget ();
  gst_segment_init (&state.segment, GST_FORMAT_TIME);
}

EventPtr
take_segment (Self *self, EventPtr event)
{
  RestoreState &state = self->state;
  const guint64 tick = locked (self, [&] { return state.tick; });
  gst_event_copy_segment (event.get (), &state.segment);
  state.whole &= state.segment_seqnum == GST_SEQNUM_INVALID;
  state.last_frame.reset ();
  state.segment_seqnum = gst_event_get_seqnum (event.get ());
  const auto order = order_of (state.segment);
  state.is_complete = order == TrackReader::Order::all;
  state.is_unwanted = false;
  state.track.next_segment (event.get (), order);
  state.partners.next_segment (event.get ());
  if (!state.track.is_linked () || tick < 2)
    return event;
  include_rounding (state.segment, tick);
  return segment_event (state.segment, state.segment_seqnum);
}

/* A serialised event, in its turn. */
gboolean
take_event (Self *self, EventPtr event)
{
  RestoreState &state = self->state;
  switch (GST_EVENT_TYPE (event.get ())) {
  case GST_EVENT_CAPS:
    state.encoded = is_encoded (caps_of (event.get ()));
    if (!state.encoded &&
        !gst_video_info_from_caps (&state.info, caps_of (event.get ())))
      return FALSE;
    break;
  case GST_EVENT_SEGMENT:
    event = take_segment (self, std::move (event));
    break;
  case GST_EVENT_TAG:
    return on_tag (self, std::move (event));
  case GST_EVENT_EOS:
    check_end (self);
    state.partners.end (GST_ELEMENT (self));
    break;
  default:
    break;
  }
  return gst_pad_event_default (
      state.sink, GST_OBJECT (self), event.release ());
}

/* ----------------------------------------------------- frames and events -- */

/* Other programs round times more. A frame that was in the segment, at @time,
 * stays in it with its exact time. */
void
keep_in_segment (RestoreState &state, GstClockTime time, GstClockTime exact)
{
  GstSegment &segment = state.segment;
  if (time < segment.start || exact >= segment.start)
    return;
  segment.time -= std::min (segment.time, segment.start - exact);
  segment.start = exact;
  gst_pad_push_event (state.src,
      segment_event (state.segment, state.segment_seqnum).release ());
}

GstFlowReturn
push_frame (Self *self, BufferPtr frame, const TrackReader::Match &match)
{
  RestoreState &state = self->state;
  frame.reset (gst_buffer_make_writable (frame.release ()));
  const GstClockTime time = GST_BUFFER_PTS (frame.get ());
  settle_setup (self, match);
  report_missing (state, match);
  if (match.line) {
    restore (self, frame.get (), match);
    keep_in_segment (state, time, GST_BUFFER_PTS (frame.get ()));
  } else
    mark_unknown (state, frame.get ());
  const GstFlowReturn flow = state.partners.attach (GST_ELEMENT (self),
      frame.get (), state.setup && state.setup->partner, state.encoded);
  if (flow != GST_FLOW_OK)
    return flow == PartnerInput::kBrokenOff ? GST_FLOW_OK : flow;
  if (GST_BUFFER_PTS_IS_VALID (frame.get ()))
    state.segment.position = GST_BUFFER_PTS (frame.get ());
  if (GST_BUFFER_DURATION_IS_VALID (frame.get ()))
    state.segment.position += GST_BUFFER_DURATION (frame.get ());
  const GstFlowReturn pushed = gst_pad_push (state.src, frame.release ());
  state.is_unwanted |= pushed == GST_FLOW_EOS;
  return pushed;
}

/* Frames whose lines are there go on, or all; events follow the frames before
 * them. */
GstFlowReturn
release (Self *self, bool all)
{
  /* A demuxer interleaves a line and its frame more closely than this. */
  constexpr std::size_t kMaxHeld = 8;
  RestoreState &state = self->state;
  GstFlowReturn flow = GST_FLOW_OK;
  while (!state.held.items.empty () && flow == GST_FLOW_OK) {
    std::optional<TrackReader::Match> match;
    if (GstBuffer *frame = state.held.first_frame ()) {
      match = GST_BUFFER_PTS_IS_VALID (frame)
                  ? state.track.take (Nanoseconds (GST_BUFFER_PTS (frame)),
                        Nanoseconds (state.segment.start),
                        !all && state.held.items.size () <= kMaxHeld)
                  : TrackReader::Match ();
      if (!match)
        break;
    }
    Item item = state.held.take_first ();
    if (auto *frame = std::get_if<BufferPtr> (&item))
      flow = push_frame (self, std::move (*frame), *match);
    else
      take_event (self, std::move (std::get<EventPtr> (item)));
  }
  return flow;
}

GstFlowReturn
chain (GstPad *, GstObject *parent, GstBuffer *buffer) noexcept
{
  auto *self = as<GstCodedExposureRestore> (parent);
  RestoreState &state = self->state;
  BufferPtr frame (buffer);
  state.damage.frame ();
  if (!state.track.is_linked ()) {
    say_no_track (self);
    if (state.announced) {
      frame.reset (gst_buffer_make_writable (frame.release ()));
      mark_unknown (state, frame.get ());
    }
    return gst_pad_push (state.src, frame.release ());
  }
  state.held.add (std::move (frame));
  return release (self, false);
}

/* All lines that stand before @next in the file have come. A frame that still
 * waits for its own was the last one that a seek let through. Returns it: if
 * the seek was to where the demuxer was, it goes on behind it. */
BufferPtr
leave_segment (Self *self, const GstSegment &next)
{
  HeldItems &held = self->state.held;
  BufferPtr last;
  do {
    release (self, false);
    if (held.first_frame ())
      last = std::get<BufferPtr> (held.take_first ());
  } while (!held.items.empty ());
  if (last && (next.rate < 0 || GST_BUFFER_PTS (last.get ()) < next.start))
    last.reset ();
  return last;
}

gboolean
sink_event (GstPad *pad, GstObject *parent, GstEvent *owned) noexcept
{
  auto *self = as<GstCodedExposureRestore> (parent);
  RestoreState &state = self->state;
  EventPtr event (owned);
  const GstEventType type = GST_EVENT_TYPE (owned);
  if (type == GST_EVENT_FLUSH_START)
    state.partners.let_wait (false);
  if (type == GST_EVENT_FLUSH_STOP) {
    state.partners.let_wait (true);
    forget_frames (state);
    state.whole = false;
    state.is_unwanted = true; // until a segment says what is
  }
  if (!(gst_event_type_get_flags (type) & GST_EVENT_TYPE_SERIALIZED) ||
      type == GST_EVENT_FLUSH_STOP)
    return gst_pad_event_default (pad, parent, event.release ());
  /* No line follows the end. */
  if (type == GST_EVENT_EOS)
    release (self, true);
  if (type == GST_EVENT_SEGMENT) {
    BufferPtr left = leave_segment (self, *segment_of (owned));
    const gboolean is_taken = take_event (self, std::move (event));
    if (left)
      state.held.add_left (std::move (left));
    return is_taken;
  }
  if (state.held.items.empty ())
    return take_event (self, std::move (event));
  state.held.items.push_back (std::move (event));
  return TRUE;
}

/* The demuxer of the frames is that of their track and partners. */
gboolean
src_event (GstPad *, GstObject *parent, GstEvent *event) noexcept
{
  return gst_pad_push_event (state_in<Self> (parent).sink, event);
}

/* The default asks the track, too, whose caps are none of the frames'. */
gboolean
src_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept
{
  if (GST_QUERY_TYPE (query) != GST_QUERY_CAPS)
    return gst_pad_query_default (pad, parent, query);
  const CapsPtr own (gst_pad_get_pad_template_caps (pad));
  const CapsPtr before (
      gst_pad_peer_query_caps (state_in<Self> (parent).sink, nullptr));
  answer_caps (query, intersect_caps (before.get (), own.get ()));
  return TRUE;
}

/* --------------------------------------------------------------- element -- */

bool
begin_run (GstElement *element)
{
  RestoreState &state = state_in<Self> (element);
  static_cast<Run &> (state) = {};
  forget_frames (state);
  state.track.restart ();
  state.partners.restart ();
  state.damage.restart ();
  return true;
}

StructurePtr
stats_of (const RestoreState &state)
{
  return state.damage.stats (state.track.damaged ());
}

PropertyTable<RestoreState>
properties ()
{
  return {
      {"tick", "Tick", "To which the container rounds times, ns", kReadWrite,
          &RestoreState::tick, guint64 (1), guint64 (GST_SECOND)},
      {"counters", "Statistics", "Those of codedexposure-recorddemux",
          kReadOnly, stats_of}};
}

constexpr StateHooks kRun{.begin = begin_run,
    .halt =
        [] (GstElement *self) {
          state_in<Self> (self).partners.let_wait (false);
        },
    .end = [] (GstElement *self) { forget_frames (state_in<Self> (self)); }};

void
set_up (gpointer klass)
{
  GST_DEBUG_CATEGORY_INIT (codedexposure_restore_debug, "codedexposure-restore",
      0, "truth of recorded coded frames");
  install_state<GstCodedExposureRestore, properties> (klass);
  install_run<kRun> (klass);
  describe_element (klass, "Coded exposure restorer", "Filter/Analyzer/Video",
      "Puts back onto recorded coded frames what their track says, and checks "
      "their pixels",
      {});
  PartnerInput::add_signal (klass);
  add_part_templates (klass);
  add_pad_template (
      klass, "partner", {.caps = kPartCaps, .direction = GST_PAD_SINK});
  add_pad_template (klass, "track",
      {.caps = "text/x-raw,format={utf8,pango-markup}",
          .direction = GST_PAD_SINK});
}

void
set_up_instance (Self *self)
{
  RestoreState &state = self->state;
  const auto add = [self] (const char *name) {
    GstPad *pad = add_pad (GST_ELEMENT (self), name);
    GST_PAD_SET_PROXY_CAPS (pad);
    GST_PAD_SET_PROXY_ALLOCATION (pad);
    return pad;
  };
  state.sink = add ("sink");
  gst_pad_set_chain_function (state.sink, chain);
  gst_pad_set_event_function (state.sink, sink_event);
  state.src = add ("src");
  gst_pad_set_event_function (state.src, src_event);
  gst_pad_set_query_function (state.src, src_query);
  state.track.take_over (add_pad (GST_ELEMENT (self), "track"));
  state.partners.take_over (add_pad (GST_ELEMENT (self), "partner"));
}

} // namespace

GType
gst_coded_exposure_restore_get_type ()
{
  return type_of<Self, set_up, set_up_instance> (
      "GstCodedExposureRestore", GST_TYPE_ELEMENT);
}

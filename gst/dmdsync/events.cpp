/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync's caps, events and queries. */
#include <algorithm>

#include "common/tag.h"
#include "dmdsync.h"

#define GST_CAT_DEFAULT dmdsync_debug

namespace codedexposure::gst::sync
{

namespace
{

/** The rate of the caps, else that at which the schedule's own slots follow
 * each other without a pause. */
Result<FrameRate>
frame_rate (const GstVideoInfo &info, const Schedule &schedule)
{
  if (info.fps_n > 0)
    return FrameRate{info.fps_n, info.fps_d};

  const Timing &timing = schedule.timing ();
  const Nanoseconds cycle =
      schedule.slots () * (timing.active + timing.switching) + timing.readout;
  if (timing.active == 0 || cycle > G_MAXINT)
    return Error{"the caps have no frame rate, and the schedule " +
                 schedule.text () +
                 " does not say how long its slots are; add "
                 "framerate=25/1 to the caps, or active= to the schedule"};
  return FrameRate{int (GST_SECOND), int (cycle)};
}

Result<Timebase>
make_timebase (GstCaps *caps, const SyncState &st)
{
  Timebase time;
  if (!gst_video_info_from_caps (&time.info, caps))
    return Error{"caps that are no video"};
  const Result<FrameRate> rate = frame_rate (time.info, st.schedule);
  if (!rate)
    return rate.error ();
  time.rate = *rate;

  const Result<SlotPlan> plan =
      SlotPlan::fit (st.schedule.timing (), st.schedule.slots (), time.rate);
  if (!plan)
    return plan.error ();
  time.plan = *plan;
  if (st.bench) {
    const int bits = GST_VIDEO_FORMAT_INFO_BITS (time.info.finfo);
    if (const auto fits =
            st.bench->check_frames ({time.info.width, time.info.height},
                st.bench->bits > bits ? bits : 0);
        !fits)
      return fits.error ();
  }
  if (st.runner)
    if (const Result<void> fits =
            check_limits (st.runner->info (), st.schedule, time.plan);
        !fits)
      return fits.error ();

  const PhaseWatch watch (st.schedule, time.info.width, time.info.height);
  if (st.schedule.pilot_rows () > 0 && !watch.complete ())
    return Error{
        "frames of " + size_text ({time.info.width, time.info.height}) +
        " cannot hold the pilot of " + st.schedule.text () + ", which is " +
        std::to_string (kPilotColumns) + " pixels wide and " +
        std::to_string (st.schedule.pilot_rows ()) +
        " rows high; use larger frames, or a schedule without pilot"};
  return time;
}

/* @p first: number of the first one. */
void
begin_frames (GstDmdSync *self, std::uint64_t first)
{
  Stream &stream = state (self).stream;
  stream.sequence.emplace (stream.time->rate, first);
  stream.rate_watch.emplace (stream.time->rate);
  begin_phase (self);
  stream.last.reset ();
}

void
resync (Stream &stream)
{
  if (!stream.sequence)
    return;
  stream.sequence->resync ();
  stream.rate_watch->resync ();
}

/** What the tag says: the schedule is ours, the rest is upstream's; so is the
 * bench profile of a bench that is simulated there. */
StreamSetup
own_setup (GstDmdSync *self)
{
  SyncState &st = state (self);
  const StreamSetup &theirs = st.stream.upstream;
  StreamSetup setup =
      setup_at (GST_BASE_TRANSFORM_SRC_PAD (self), st.schedule, theirs.mapping);
  setup.simulated = theirs.simulated;
  setup.off_beam = is_off_beam (self);
  const auto &frames = st.stream.frames;
  setup.bits = frames && frames->knows_bits () ? frames->bits () : theirs.bits;
  setup.bench = theirs.bench ? theirs.bench : st.bench;
  return setup;
}

bool
push_tag (GstDmdSync *self)
{
  if (!std::exchange (state (self).stream.tag_due, false))
    return true;
  return gst_pad_push_event (
      GST_BASE_TRANSFORM_SRC_PAD (self), setup_to_event (own_setup (self)));
}

/** Takes over what a setup of upstream says of its bench. */
void
take_bench (GstDmdSync *self, const StreamSetup &theirs)
{
  SyncState &st = state (self);
  const int black = black_level (st);
  st.stream.upstream = theirs;
  if (st.stream.time && black != black_level (st))
    begin_phase (self);
  if (st.bench && theirs.bench)
    if (const auto same = st.bench->check_bench (*theirs.bench); !same)
      POST_ERROR (self, STREAM, WRONG_TYPE,
          "The bench profile does not fit the stream's: " +
              same.error ().message);
}

/** @p event, or one in which our schedule takes the place of another. */
GstEvent *
own_schedule (GstDmdSync *self, GstEvent *event)
{
  refuse_decoded (self, event);
  SyncState &st = state (self);
  GstTagList *tags = tags_of (event);
  const auto theirs = setup_from_tags (tags);
  if (theirs && (!*theirs || !(theirs->value ().schedule == st.schedule)) &&
      !std::exchange (st.stream.warned_tag, true))
    POST_WARNING (self, STREAM, WRONG_TYPE,
        "The stream was tagged with the schedule " +
            (*theirs ? theirs->value ().schedule.text ()
                     : "that is unreadable") +
            ", but the DMD shows " + st.schedule.text () +
            ": the tag now says the latter. Give both elements the same "
            "schedule.");
  if (gst_tag_list_get_scope (tags) == GST_TAG_SCOPE_GLOBAL && !theirs)
    return event;

  /* The last tags of a scope are those that a late link gets: ours are always
   * among them. */
  if (theirs && *theirs)
    take_bench (self, theirs->value ());
  return replace_setup (event, own_setup (self));
}

/** A gap in place of frames moves as they do. */
GstEvent *
moved_gap (GstDmdSync *self, GstEvent *event)
{
  GstClockTime pts = 0, duration = 0;
  gst_event_parse_gap (event, &pts, &duration);
  const GstClockTimeDiff by =
      locked (self, [&] { return moved_back (state (self)); });
  const GstClockTimeDiff start = std::max<GstClockTimeDiff> (
      0, GstClockTimeDiff (pipeline_time_of_gap (self, pts)) - by);
  const EventPtr came (event);
  return gap_like (event, GstClockTime (start), duration).release ();
}

/* The tag has the size and the rate; before a segment, it is due anyway. */
gboolean
take_caps (GstDmdSync *self, GstEvent *event)
{
  Stream &stream = state (self).stream;
  const bool said = !stream.tag_due;
  if (!base_transform_class ()->sink_event (GST_BASE_TRANSFORM (self), event))
    return FALSE;
  stream.tag_due |= said;
  return !said || push_tag (self);
}

gboolean
take_segment (GstDmdSync *self, GstEvent *event)
{
  Stream &stream = state (self).stream;
  if (!counts_time (self, *segment_of (event))) {
    gst_event_unref (event);
    return FALSE;
  }
  resync (stream);
  stream.device_clock.reset ();
  const gboolean taken =
      base_transform_class ()->sink_event (GST_BASE_TRANSFORM (self), event);
  return push_tag (self) && taken;
}

/* Posted once, although a source offers the same caps again before it gives up.
 */
void
refuse (GstDmdSync *self, GstCaps *incaps, const std::string &why)
{
  if (std::exchange (state (self).stream.refused, why) != why)
    GST_ELEMENT_ERROR (self, RESOURCE, SETTINGS,
        ("The frames do not fit the schedule: %s", why.c_str ()),
        ("%" GST_PTR_FORMAT, (void *)incaps));
}

} // namespace

int
black_level (const SyncState &st)
{
  const auto &theirs = st.stream.upstream.bench;
  const auto &bench = theirs ? theirs : st.bench;
  return bench ? bench->black () : 0;
}

bool
is_off_beam (GstDmdSync *self)
{
  const SyncState &st = state (self);
  return locked (self, [&] { return st.settings.beam; }) == Beam::kOff ||
         st.stream.upstream.off_beam;
}

void
begin_phase (GstDmdSync *self)
{
  SyncState &st = state (self);
  Stream &stream = st.stream;
  const GstVideoInfo &info = stream.time->info;
  const bool triggers = st.runner && st.runner->info ().triggers_camera;
  const int black = black_level (st);
  stream.watch.emplace (st.schedule, info.width, info.height, black);
  stream.lock.emplace (PhaseLock::Options{
      .observable = stream.watch->complete () ? slip_observable (st.schedule)
                                              : SlipObservable::never,
      .can_restart = st.runner != nullptr,
      .gap_shows_restart = triggers});
  if (stream.coded)
    stream.shown = SwitchWatch (triggers, black);
}

gboolean
set_caps (GstBaseTransform *trans, GstCaps *incaps, GstCaps *)
{
  auto *self = as<GstDmdSync> (trans);
  SyncState &st = state (self);
  const Result<Timebase> time = make_timebase (incaps, st);
  if (!time) {
    refuse (self, incaps, time.error ().message);
    return FALSE;
  }
  const bool restart = !st.stream.time || st.stream.time->rate != time->rate;
  st.stream.time = *time;
  Result<OwnedFrames> frames =
      OwnedFrames::make (time->info, settings_of (self).pixel_format);
  if (!frames) {
    st.stream.time.reset ();
    refuse (self, incaps, frames.error ().message);
    return FALSE;
  }
  st.stream.frames = *std::move (frames);
  st.stream.refused.clear ();
  locked (self, [&] { st.time = *time; });
  /* Other caps are another stretch of the same stream. */
  begin_frames (
      self, st.stream.sequence ? st.stream.sequence->next_number () : 0);
  st.stream.discont = true;
  update_latency (self);
  give_back (self, "caps");
  if (!st.runner || !restart)
    return TRUE;
  st.runner->start (time->plan);
  st.runner->settle ();
  /* A wait that a flush or a change of state cut short is no fault of the caps.
   */
  return !st.runner->failed ();
}

gboolean
sink_event (GstBaseTransform *trans, GstEvent *event)
{
  auto *self = as<GstDmdSync> (trans);
  SyncState &st = state (self);
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_STREAM_START:
    /* Nothing flows before the masks are on the device: not even caps, for
     * which a simulated bench needs to know them. On the way down, frames are
     * refused as flushing; an event that fails would be an error. */
    if (st.runner && !st.runner->settle () && !st.runner->halted ()) {
      gst_event_unref (event);
      return FALSE;
    }
    st.stream.tag_due = true;
    st.stream.warned_tag = false;
    st.stream.discont = true;
    st.stream.sequence.reset ();
    if (st.stream.time)
      begin_frames (self, 0);
    break;
  case GST_EVENT_CAPS:
    return take_caps (self, event);
  case GST_EVENT_SEGMENT:
    return take_segment (self, event);
  case GST_EVENT_TAG:
    event = own_schedule (self, event);
    break;
  case GST_EVENT_GAP:
    event = moved_gap (self, event);
    break;
  case GST_EVENT_FLUSH_START:
    if (const auto runner = runner_of (self))
      runner->interrupt (true);
    break;
  case GST_EVENT_EOS:
    note_end (self);
    give_back (self, "eos");
    break;
  case GST_EVENT_FLUSH_STOP:
    give_back (self, "flush");
    if (st.runner)
      st.runner->interrupt (false);
    resync (st.stream);
    st.stream.last.reset ();
    st.stream.ready.clear ();
    st.stream.discont = true;
    break;
  default:
    break;
  }
  return base_transform_class ()->sink_event (trans, event);
}

/* A camera source that waits for a frame with its object lock held, as
 * aravissrc does, would keep a QoS event, and with it the sink, waiting. */
gboolean
src_event (GstBaseTransform *trans, GstEvent *event)
{
  if (GST_EVENT_TYPE (event) == GST_EVENT_QOS) {
    gst_event_unref (event);
    return TRUE;
  }
  if (const auto request = parse_event<PatternRequest> (event)) {
    gst_event_unref (event);
    return take_request (as<GstDmdSync> (trans), *request);
  }
  return base_transform_class ()->src_event (trans, event);
}

/* Frames that are given an earlier PTS are later by as much. */
gboolean
query (GstBaseTransform *trans, GstPadDirection direction, GstQuery *query)
{
  const SyncState &st = state (trans);
  if (direction == GST_PAD_SRC && is_query<MirrorsAnswer> (query)) {
    answer_query (query, describe_mirrors (as<GstDmdSync> (trans)));
    return TRUE;
  }
  if (direction == GST_PAD_SINK && is_query<SwitchAnswer> (query)) {
    answer_query (query, describe_switch (as<GstDmdSync> (trans)));
    return TRUE;
  }
  if (!base_transform_class ()->query (trans, direction, query))
    return FALSE;
  if (GST_QUERY_TYPE (query) == GST_QUERY_LATENCY && direction == GST_PAD_SRC) {
    const ObjectLock lock (trans);
    add_latency (query, st.latency);
  }
  return TRUE;
}

} // namespace codedexposure::gst::sync

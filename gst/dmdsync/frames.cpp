/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync, frame by frame: time, number, phase. */
#include "common/messages.h"
#include "common/meta.h"
#include "dmdsync.h"

#define GST_CAT_DEFAULT dmdsync_debug

namespace codedexposure::gst::sync
{

namespace
{

/* A longer gap is not filled with repeated frames: four seconds at 25 a second.
 */
constexpr guint64 kMostRepeats = 100;

/* Frames without a readable pilot until a warning: a second at 25 a second. */
constexpr int kUnproven = 25;

/** A frame on its way: what came, and what is known of it. */
struct Frame {
  BufferPtr buffer;
  bool readable = false;
  FrameStep step;
  GstClockTime pts;
  LockDecision phase;
  std::string pattern; ///< as in the frame meta
};

void
count (GstDmdSync *self, guint64 Counters::*counter, guint64 more = 1)
{
  const ObjectLock lock (self);
  state (self).counters.*counter += more;
}

/** Posts that @p frame is dropped. Returns GST_BASE_TRANSFORM_FLOW_DROPPED. */
GstFlowReturn
drop (GstDmdSync *self, const Frame &frame, const char *reason)
{
  GST_DEBUG_OBJECT (self, "frame %" G_GUINT64_FORMAT " dropped: %s",
      frame.step.number, reason);
  post_message (
      self, FrameDropped{guint64 (frame.step.number), frame.pts, reason});
  return GST_BASE_TRANSFORM_FLOW_DROPPED;
}

/** In place of frames that are missing. */
void
push_gap (GstDmdSync *self, GstClockTime from, GstClockTime duration)
{
  GstEvent *gap = gst_event_new_gap (from, duration);
  gst_event_set_gap_flags (gap, GST_GAP_FLAG_MISSING_DATA);
  gst_pad_push_event (GST_BASE_TRANSFORM_SRC_PAD (self), gap);
}

/** The same for a frame whose time is left empty. */
GstFlowReturn
drop_with_gap (GstDmdSync *self, const Frame &frame, const char *reason)
{
  Stream &stream = state (self).stream;
  drop (self, frame, reason);
  stream.discont = true;
  push_gap (self, frame.pts, GstClockTime (stream.time->rate.period ()));
  return GST_BASE_TRANSFORM_FLOW_DROPPED;
}

FrameMeta
meta_of (const Timebase &time, guint64 number, GstClockTime pts)
{
  FrameMeta meta;
  meta.frame = number;
  meta.exposure_start = pts;
  meta.exposure_duration = GstClockTime (time.plan.exposure ());
  return meta;
}

/** Times, number and meta of a frame that is ready. @p buffer is writable. */
void
stamp (GstDmdSync *self, GstBuffer *buffer, FrameMeta meta)
{
  Stream &stream = state (self).stream;
  GST_BUFFER_PTS (buffer) = meta.exposure_start;
  GST_BUFFER_DTS (buffer) = GST_CLOCK_TIME_NONE;
  /* Of camera sources it is the distance to the frame before. */
  GST_BUFFER_DURATION (buffer) = GstClockTime (stream.time->rate.period ());
  GST_BUFFER_OFFSET (buffer) = meta.frame;
  GST_BUFFER_OFFSET_END (buffer) = meta.frame + 1;
  if (std::exchange (stream.discont, false))
    GST_BUFFER_FLAG_SET (buffer, GST_BUFFER_FLAG_DISCONT);
  const FrameMeta said = get_frame_meta (buffer).value_or (FrameMeta ());
  meta.bits = stream.frames->knows_bits () ? stream.frames->bits () : said.bits;
  /* Else it is that which the schedule asks for. */
  if (GST_CLOCK_TIME_IS_VALID (said.exposure_duration))
    meta.exposure_duration = said.exposure_duration;
  set_frame_meta (buffer, meta);
}

/** Fills the place of the frames that are missing before @p frame, the first
 * of which was due at @p from. */
void
fill_gap (
    GstDmdSync *self, const Frame &frame, GstClockTime from, OnLoss on_loss)
{
  Stream &stream = state (self).stream;
  const FrameRate rate = stream.time->rate;
  const guint64 lost = frame.step.lost;
  if (GST_BASE_TRANSFORM (self)->segment.rate < 0)
    return;
  if (on_loss != OnLoss::repeat || !stream.last || lost > kMostRepeats ||
      GstClockTime (rate.time_of (gint64 (lost))) > frame.pts)
    return push_gap (self, from, frame.pts - from);
  for (guint64 k = 0; k < lost; k++) {
    BufferPtr filler (gst_buffer_copy (stream.last.get ()));
    GST_BUFFER_FLAG_UNSET (filler.get (), GST_BUFFER_FLAG_DISCONT);
    GST_BUFFER_FLAG_SET (
        filler.get (), GST_BUFFER_FLAG_GAP | GST_BUFFER_FLAG_DROPPABLE);
    stamp (self, filler.get (),
        meta_of (*stream.time, frame.step.number - lost + k,
            from + GstClockTime (rate.time_of (gint64 (k)))));
    stream.ready.push_back (std::move (filler));
  }
  count (self, &Counters::frames_repeated, lost);
}

GstFlowReturn
take_loss (GstDmdSync *self, const Frame &frame)
{
  Stream &stream = state (self).stream;
  const guint64 lost = frame.step.lost;
  const GstClockTime gap =
      GstClockTime (stream.time->rate.time_of (gint64 (lost)));
  const GstClockTime from = frame.pts - std::min (frame.pts, gap);
  const OnLoss on_loss = settings_of (self).on_loss;

  stream.discont = true;
  if (describe_switch (self).switching) {
    fill_gap (self, frame, from, OnLoss::gap);
    return GST_FLOW_OK;
  }
  count (self, &Counters::frames_lost, lost);
  GST_INFO_OBJECT (self,
      "frames lost before %" GST_TIME_FORMAT ": %" G_GUINT64_FORMAT,
      GST_TIME_ARGS (frame.pts), lost);
  post_message (self, FramesLost{lost, from, frame.pts});
  if (on_loss == OnLoss::error && stream.coded) {
    GST_ELEMENT_ERROR (self, RESOURCE, READ,
        ("%" G_GUINT64_FORMAT " %s lost before %" GST_TIME_FORMAT
         ", and on-loss=error says to stop",
            lost, lost == 1 ? "frame was" : "frames were",
            GST_TIME_ARGS (frame.pts)),
        (nullptr));
    return GST_FLOW_ERROR;
  }
  fill_gap (self, frame, from, on_loss);
  return GST_FLOW_OK;
}

/** Handles losses, duplicates and late frames. */
GstFlowReturn
take_arrival (GstDmdSync *self, const Frame &frame)
{
  Stream &stream = state (self).stream;
  switch (frame.step.arrival) {
  case Arrival::duplicate:
  case Arrival::behind:
    count (self, &Counters::frames_duplicate);
    return drop (self, frame, "duplicate");
  case Arrival::after_loss:
    return take_loss (self, frame);
  case Arrival::late:
    locked (self, [&counters = state (self).counters] {
      counters.frames_late++;
      /* It was counted as one of these. */
      counters.frames_lost -= std::min<guint64> (counters.frames_lost, 1);
    });
    post_message (self, FrameLate{guint64 (frame.step.number), frame.pts});
    stream.discont = true;
    return GST_FLOW_OK;
  case Arrival::restarted:
    GST_WARNING_OBJECT (
        self, "time went back to %" GST_TIME_FORMAT, GST_TIME_ARGS (frame.pts));
    stream.discont = true;
    return GST_FLOW_OK;
  default:
    return GST_FLOW_OK;
  }
}

/** Counts a frame of which a part is missing. */
GstFlowReturn
take_whole (GstDmdSync *self, const Frame &frame)
{
  GstBuffer *buffer = frame.buffer.get ();
  if (!frame.readable ||
      GST_BUFFER_FLAG_IS_SET (buffer, GST_BUFFER_FLAG_CORRUPTED)) {
    count (self, &Counters::frames_incomplete);
    post_message (self, FrameIncomplete{guint64 (frame.step.number), frame.pts,
                            gst_buffer_get_size (buffer)});
  }
  return frame.readable ? GST_FLOW_OK
                        : drop_with_gap (self, frame, "incomplete");
}

PhaseSight
look_at (GstDmdSync *self, GstBuffer *buffer)
{
  Stream &stream = state (self).stream;
  MappedFrame mapped (stream.time->info, buffer, GST_MAP_READ);
  if (!mapped) {
    GST_WARNING_OBJECT (self, "frame cannot be read: its phase is not known");
    return {};
  }
  return read_pixels (
      mapped, [&] (auto pixels) { return stream.watch->look (pixels); });
}

void
say_phase (GstDmdSync *self, const Frame &frame)
{
  SyncState &st = state (self);
  const LockDecision &phase = frame.phase;
  if (phase.slipped) {
    count (self, &Counters::slips);
    GST_WARNING_OBJECT (
        self, "the DMD slipped by %d slots", phase.slipped->slots);
    post_message (
        self, Slip{guint64 (phase.slipped->first_frame), phase.slipped->slots,
                  phase.slipped->certain, frame.pts});
  }
  if (phase.slip_over)
    post_message (self, SlipOver{guint64 (frame.step.number), frame.pts});
  if (phase.locked_now)
    post_message (self, Locked{guint64 (frame.step.number), frame.pts});

  if (locked (self, [&] {
        return std::exchange (st.locked, phase.locked) != phase.locked;
      }))
    g_object_notify (G_OBJECT (self), "locked");
}

/** Warns, once in a stream, if the pilot shows the phase of no frame. */
void
watch_pilot (GstDmdSync *self, const Frame &frame)
{
  SyncState &st = state (self);
  Stream &stream = st.stream;
  if (st.schedule.pilot_rows () == 0)
    return;
  stream.unproven = frame.phase.locked ? 0 : stream.unproven + 1;
  if (stream.unproven < kUnproven || std::exchange (stream.warned_pilot, true))
    return;
  POST_WARNING (self, STREAM, DECODE,
      "The pilot shows the phase of the masks in none of " +
          std::to_string (kUnproven) +
          " frames, which are not known to be synchronised: its " +
          std::to_string (st.schedule.pilot_rows ()) +
          " rows, the last of the mirrors that show masks, are too dark in "
          "places, not at the bottom of the picture, or show other masks. "
          "Light them evenly, expose for longer, or reserve more rows; give "
          "the mirrors that the camera sees as region= of the device; and let "
          "no other program use the DMD.");
}

/** What becomes of a frame whose masks are not synchronised. */
GstFlowReturn
take_unlocked (GstDmdSync *self, const Frame &frame)
{
  switch (settings_of (self).on_unlock) {
  case OnUnlock::skip:
    count (self, &Counters::frames_skipped);
    return drop_with_gap (self, frame, "not-locked");
  case OnUnlock::error:
    GST_ELEMENT_ERROR (self, RESOURCE, FAILED,
        ("The masks of the DMD are late in frame %" G_GUINT64_FORMAT
         " (slots: %d), and on-unlock=error says to stop",
            guint64 (frame.step.number), frame.phase.slip),
        (nullptr));
    return GST_FLOW_ERROR;
  default:
    GST_BUFFER_FLAG_SET (frame.buffer.get (), GST_BUFFER_FLAG_CORRUPTED);
    return GST_FLOW_OK;
  }
}

/** Checks the phase, and restarts the DMD after a slip. */
void
watch_phase (GstDmdSync *self, Frame &frame)
{
  SyncState &st = state (self);
  if (is_off_beam (self))
    return;
  if (!frame.pattern.empty ()) {
    frame.phase.locked = false;
    return say_phase (self, frame);
  }
  frame.phase = st.stream.lock->take (look_at (self, frame.buffer.get ()),
      frame.step.number, frame.step.lost, st.runner && st.runner->settled ());
  if (frame.phase.restart)
    st.runner->start (st.stream.time->plan);
  say_phase (self, frame);
  watch_pilot (self, frame);
}

/** A frame whose time stamps do not continue those before: by the pipeline's
 * clock, it follows all the same. Returns the PTS that it came with, by that
 * clock. */
GstClockTime
place_after_restart (GstDmdSync *self, Frame &frame)
{
  Stream &stream = state (self).stream;
  GstBuffer *buffer = frame.buffer.get ();
  const auto came = Nanoseconds (GST_BUFFER_PTS (buffer));
  GST_BUFFER_FLAG_UNSET (buffer, GST_BUFFER_FLAG_RESYNC);
  stream.device_clock.rejoin ();
  stream.rate_watch->resync ();
  stream.discont = true;
  begin_phase (self);
  const GstClockTime time = pipeline_time (self, buffer);

  frame.step = stream.sequence->take_after (
      came, Nanoseconds (time - std::min (time, stream.last_time)));
  return time;
}

/** Numbers the frame; returns the PTS that it came with, by the pipeline's
 * clock. */
GstClockTime
place (GstDmdSync *self, Frame &frame)
{
  Stream &stream = state (self).stream;
  GstBuffer *buffer = frame.buffer.get ();
  const GstClockTime came = GST_BUFFER_PTS (buffer);
  GstClockTime time = 0;
  if (GST_BUFFER_FLAG_IS_SET (buffer, GST_BUFFER_FLAG_RESYNC) &&
      stream.sequence->next_number () > 0) {
    time = place_after_restart (self, frame);
  } else {
    frame.step = stream.sequence->take (
        Nanoseconds (came), GST_BASE_TRANSFORM (self)->segment.rate < 0);
    if (frame.step.arrival == Arrival::restarted)
      stream.device_clock.reset ();
    time = pipeline_time (self, buffer);
    watch_rate (self, came);
  }
  if (frame.step.arrival != Arrival::late &&
      frame.step.arrival != Arrival::behind &&
      frame.step.arrival != Arrival::duplicate)
    stream.last_time = time;
  return time;
}

/** The meta of a frame that is pushed. */
FrameMeta
meta_of (GstDmdSync *self, const Frame &frame)
{
  const Stream &stream = state (self).stream;
  FrameMeta meta = meta_of (*stream.time, frame.step.number, frame.pts);
  meta.locked = frame.phase.locked;
  meta.slip = frame.phase.slip;
  meta.lost_before = frame.step.lost;
  meta.pattern = frame.pattern;
  meta.time_uncertainty = stream.uncertainty;
  return meta;
}

GstFlowReturn
take_frame (GstDmdSync *self, BufferPtr buffer)
{
  SyncState &st = state (self);
  Stream &stream = st.stream;
  GstClockTimeDiff back = 0;
  bool repeats = false;
  locked (self, [&] {
    back = moved_back (st);
    repeats = st.settings.on_loss == OnLoss::repeat;
    st.counters.frames_in++;
  });

  Frame frame;
  if (stream.frames->is_whole (buffer.get ()))
    if (BufferPtr owned = stream.frames->own (buffer.get ())) {
      buffer = std::move (owned);
      frame.readable = true;
    }
  frame.buffer.reset (gst_buffer_make_writable (buffer.release ()));
  const GstClockTime time = place (self, frame);
  const bool too_early = back > 0 && GstClockTime (back) > time;
  frame.pts = too_early ? 0 : time - GstClockTime (back);

  GstFlowReturn flow = take_arrival (self, frame);
  if (flow == GST_FLOW_OK)
    flow = take_whole (self, frame);
  if (flow != GST_FLOW_OK)
    return flow;
  frame.pattern =
      look_for_pattern (self, frame.buffer.get (), frame.step, frame.pts);
  watch_phase (self, frame);
  if (too_early) {
    count (self, &Counters::frames_early);
    return drop (self, frame, "before-start");
  }
  if (frame.phase.locked == false && frame.pattern.empty ())
    if (flow = take_unlocked (self, frame); flow != GST_FLOW_OK)
      return flow;

  say_uncertainty (self, frame.step.number, frame.pts);
  stamp (self, frame.buffer.get (), meta_of (self, frame));
  if (repeats)
    stream.last.reset (gst_buffer_copy (frame.buffer.get ()));
  stream.ready.push_back (std::move (frame.buffer));
  return GST_FLOW_OK;
}

} // namespace

GstFlowReturn
generate_output (GstBaseTransform *trans, GstBuffer **outbuf)
{
  auto *self = as<GstDmdSync> (trans);
  SyncState &st = state (self);
  Stream &stream = st.stream;
  if (trans->queued_buf) {
    BufferPtr buffer (std::exchange (trans->queued_buf, nullptr));
    if (st.runner && st.runner->failed ())
      return GST_FLOW_ERROR;
    if (st.runner && st.runner->halted ())
      return GST_FLOW_FLUSHING;
    if (!stream.time)
      return GST_FLOW_NOT_NEGOTIATED;
    if (!GST_BUFFER_PTS_IS_VALID (buffer.get ())) {
      POST_ERROR (self, STREAM, FORMAT,
          "A frame has no time stamp, and nothing says when it was exposed; "
          "let the source set one (do-timestamp=true)");
      return GST_FLOW_ERROR;
    }
    GST_LOG_OBJECT (self, "[IN] %" GST_TIME_FORMAT,
        GST_TIME_ARGS (GST_BUFFER_PTS (buffer.get ())));
    if (const GstFlowReturn flow = take_frame (self, std::move (buffer));
        flow != GST_FLOW_OK && flow != GST_BASE_TRANSFORM_FLOW_DROPPED)
      return flow;
  }
  if (!stream.ready.empty ()) {
    *outbuf = stream.ready.front ().release ();
    stream.ready.pop_front ();
    GST_LOG_OBJECT (self, "[OUT] %" GST_TIME_FORMAT,
        GST_TIME_ARGS (GST_BUFFER_PTS (*outbuf)));
  }
  return GST_FLOW_OK;
}

} // namespace codedexposure::gst::sync

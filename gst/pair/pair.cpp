/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-pair
 * @title: codedexposure-pair
 * @short_description: Coded frames with those of a second camera
 *
 * A mirror that is off throws its light away from the camera. A second camera
 * there sees the complement of every mask: together both get all of the light.
 * This element takes the coded frames of the first camera, the beam of the
 * mirrors that are on, and gives each the frame of the second that was exposed
 * at the same time, its partner. codedexposure-fuse and codedexposure-sum use
 * partners; every other element sees an ordinary stream of coded frames.
 *
 * ## Pairs
 *
 * Partners are frames whose exposures begin within a quarter of a frame period
 * of each other: by the start that the metadata of both say, else by running
 * time. Arrival and numbers do not count. A coded frame without a partner
 * passes alone, as it came. So does one that is corrupted, or whose partner is.
 * A frame of the second camera without a coded frame is dropped, and so is one
 * with another schedule, which is a warning. Both cameras must have the same
 * pixel format, with the same number of significant bits; their sizes may
 * differ.
 *
 * Time stamps can be wrong by a frame. The sum of both beams has the light of
 * the whole exposure and shows no masks; that of different exposures shows them
 * where the scene moves. A pair that is clearly worse than either frame would
 * be with one of the three frames before of the other camera, or, after frames
 * that were alone, clearly worse than the last good pair, is therefore none:
 * the coded frame passes alone. Eight of these in a row are a warning. Where
 * nothing moves, a wrong pair is not noticed, and does no harm. This needs the
 * schedule in a tag, as codedexposure-sim, dmdsync and recordings have it, and,
 * where frames do not lie on the mirrors pixel by pixel, the mappings of both
 * cameras.
 *
 * In a live pipeline, a coded frame waits for its partner as long as the
 * latency of the slower camera and a quarter of a frame period allow, and then
 * goes alone. The property `latency` adds to that: a pipeline that records, and
 * nobody looks at, can wait for a second (latency=1000000000). A frame of the
 * second camera waits for a second longer, and is then dropped, so that its
 * source goes on while the first camera is silent.
 *
 * ## Drift
 *
 * Once a second, the places of the scene in both frames are compared: summed
 * over a period of the masks, both are ordinary pictures of the same light.
 * What is between them is the error of the mappings
 * (#codedexposure-pair:drift-x, #codedexposure-pair:drift-y, in mirrors). When
 * the median of five seconds is above 0.1 mirrors by three standard deviations,
 * one of the cameras has moved, and the message `codedexposure/partner-drift`
 * (`active` TRUE, `x`, `y`, `uncertainty`, `at-x`, `at-y`, `from`) says so, and
 * when that is over. A scene without texture shows nothing.
 *
 * ## Flags, metas and messages
 *
 * A partner is in the custom meta `CodedExposurePartner` of the coded frame,
 * with the fields `buffer` and `caps`. What changes the pixels of the coded
 * frame drops it, and it does not leave the process. The stream tag of the
 * coded frames gets the key `partner` with size, mapping, black level and noise
 * of the second camera, as its bench profile has them.
 *
 * The message `codedexposure/partner-lost` is posted when coded frames begin to
 * go on alone (`active` TRUE, `reason`, `from`) and when they have partners
 * again (`frames` how many were alone, `reason` of the first, `from`, `to`, at
 * the end of the stream the last of them). The reason is `missing`, `damaged`,
 * `other-schedule` or `other-exposure`. #codedexposure-pair:frames-paired,
 * #codedexposure-pair:pairs-confirmed, #codedexposure-pair:frames-alone,
 * #codedexposure-pair:pairs-refused and #codedexposure-pair:partners-dropped
 * count, and can be read until the next run starts.
 *
 * ## Example pipeline
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! tee name=light \
 *     light. ! queue ! codedexposure-sim schedule=sequential:lattice:4/2 \
 *     ! pair.on \
 *     light. ! queue ! codedexposure-sim schedule=sequential:lattice:4/2 \
 *     beam=off seed=1 ! pair.off \
 *     codedexposure-pair name=pair ! codedexposure-fuse \
 *     ! queue ! videoconvert ! autovideosink
 * ]| A simulated bench with two cameras.
 *
 * Since: 0.2
 */
#include <optional>
#include <string>

#include <gst/base/gstaggregator.h>

#include "common/elements.h"
#include "common/meta.h"
#include "common/partner.h"
#include "pair/pair.h"

GST_DEBUG_CATEGORY_STATIC (codedexposure_pair_debug);
#define GST_CAT_DEFAULT codedexposure_pair_debug

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::gst::pairs;

namespace
{

/* Wrong pairs in a row that are no accident. */
constexpr guint64 kOutOfStep = 8;

/* Beyond the latency, for a first camera that is silent. */
constexpr GstClockTime kPatience = GST_SECOND;

/* ---------------------------------------------------------------- times -- */

GstSegment
segment_at (GstAggregatorPad *pad)
{
  return locked (pad, [pad] { return pad->segment; });
}

/** As the frame's meta says, on the clock of both cameras, or before its zero
 * if time runs backwards, and by its PTS, as running time. */
struct Instant {
  std::optional<GstClockTimeDiff> said, running;
};

Instant
instant_of (GstAggregatorPad *pad, GstBuffer *frame)
{
  const auto known = [] (GstClockTime time) {
    return GST_CLOCK_TIME_IS_VALID (time)
               ? std::optional (GstClockTimeDiff (time))
               : std::nullopt;
  };
  const GstSegment segment = segment_at (pad);
  const auto meta = get_frame_meta (frame);
  Instant instant{known (meta ? meta->exposure_start : GST_CLOCK_TIME_NONE),
      known (running_time (segment, GST_BUFFER_PTS (frame)))};
  if (instant.said && segment.rate < 0.0)
    instant.said = -*instant.said;
  return instant;
}

/* By how much @one is played later; none: it is not known. Recordings of both
 * cameras may begin with different frames, so what was said comes first. */
std::optional<GstClockTimeDiff>
later_by (const Instant &one, const Instant &other)
{
  for (const auto member : {&Instant::said, &Instant::running})
    if (one.*member && other.*member)
      return *(one.*member) - *(other.*member);
  return std::nullopt;
}

/* From one frame to the next. @info: of their caps. */
GstClockTime
period_of (const GstVideoInfo &info, GstBuffer *frame)
{
  if (info.fps_n > 0)
    return gst_util_uint64_scale (GST_SECOND, info.fps_d, info.fps_n);
  return GST_BUFFER_DURATION_IS_VALID (frame) ? GST_BUFFER_DURATION (frame)
                                              : 40 * GST_MSECOND;
}

/* ------------------------------------------------------- whether it fits -- */

struct Judgement {
  const char *alone = nullptr; ///< why a coded frame goes on alone; null: not
  /* What its pixels and those of its partner show: */
  bool is_confirmed = false, is_refused = false;
};

/* For the streams as they are. */
PairCheck &
check_of (GstCodedExposurePair *self)
{
  PairState &st = state (self);
  if (std::exchange (st.check_due, false)) {
    if (st.on.caps && st.off.caps)
      st.check.configure (st.on, st.off);
    st.drift.reset ();
  }
  return st.check;
}

/* Pairs that follow are compared with it. */
void
take_alone (GstCodedExposurePair *self, GstBuffer *frame, bool off)
{
  if (!is_corrupted (frame) && !shows_pattern (frame))
    check_of (self).take_alone (frame, off);
}

void
watch_drift (GstCodedExposurePair *self, GstBuffer *coded, GstBuffer *partner)
{
  PairState &st = state (self);
  const GstClockTime pts = GST_BUFFER_PTS (coded);
  if (!GST_CLOCK_TIME_IS_VALID (pts) || !st.drift.is_due (pts))
    return;
  st.drift.take (self, pts, st.check.drift (coded, partner));
  locked (self, [&] { st.shift = st.drift.median ().value_or (kUnknown); });
}

/* Once in a run: streams whose schedules change may do so one after the other.
 */
void
warn_of_masks (GstCodedExposurePair *self)
{
  PairState &st = state (self);
  if (!std::exchange (st.masks_said, true))
    POST_WARNING (self, STREAM, FAILED,
        "The frames of the first camera have the schedule " +
            st.on.setup->schedule.text () + ", and those of the second " +
            st.off.setup->schedule.text () +
            "; coded frames go on alone. Both cameras see the same masks: give "
            "both the same schedule.");
}

Judgement
judge (GstCodedExposurePair *self, GstBuffer *coded, GstBuffer *partner)
{
  using Verdict = PartnerWatch::Verdict;
  if (!partner) {
    take_alone (self, coded, false);
    return {"missing"};
  }
  if (is_corrupted (coded) || is_corrupted (partner))
    return {"damaged"};
  if (shows_pattern (coded) || shows_pattern (partner)) {
    state (self).check.reset ();
    return {};
  }
  if (!check_of (self).are_masks_alike ()) {
    warn_of_masks (self);
    return {"other-schedule"};
  }
  const Verdict verdict = check_of (self).check (coded, partner);
  if (verdict == Verdict::bad)
    return {"other-exposure", false, true};
  return {nullptr, verdict == Verdict::good};
}

void
warn_if_out_of_step (GstCodedExposurePair *self, bool is_refused)
{
  guint64 &refused = state (self).refused_in_a_row;
  refused = is_refused ? refused + 1 : 0;
  if (refused == kOutOfStep)
    POST_WARNING (self, STREAM, FAILED,
        "The frames of the second camera are of other exposures than the coded "
        "frames whose times they have, as their pixels show; coded frames go "
        "on alone. Trigger both cameras by one signal, and start both before "
        "it.");
}

void
count (GstCodedExposurePair *self, GstBuffer *coded, const Judgement &judged)
{
  PairState &st = state (self);
  locked (self, [&] {
    Counters &counters = st.counters;
    (judged.alone ? counters.alone : counters.paired)++;
    counters.confirmed += judged.is_confirmed;
    counters.refused += judged.is_refused;
  });
  st.alone.add (self, GST_BUFFER_PTS (coded), judged.alone);
  warn_if_out_of_step (self, judged.is_refused);
}

/* Here caps and segment of the base class have passed. */
GstPadProbeReturn
before_frame (GstPad *, GstPadProbeInfo *, gpointer data)
{
  auto *self = static_cast<GstCodedExposurePair *> (data);
  PairState &st = state (self);
  push_due (self);
  st.has_begun = true;
  return st.has_ended ? GST_PAD_PROBE_DROP : GST_PAD_PROBE_OK;
}

/* The base class pushes caps and segment with frames only, and what is due
 * comes after them: an empty frame, which the probe drops, has them pushed. */
GstFlowReturn
end (GstCodedExposurePair *self)
{
  PairState &st = state (self);
  st.alone.end (self);
  GstAggregatorPad *off = sink (self, "off");
  while (const BufferPtr left{gst_aggregator_pad_pop_buffer (off)})
    locked (self, [&] { return ++st.counters.dropped; });
  if (st.is_due ()) {
    st.has_ended = true;
    gst_aggregator_finish_buffer (GST_AGGREGATOR (self), gst_buffer_new ());
    st.has_ended = false;
  }
  return GST_FLOW_EOS;
}

/* As its metadata say, else its tags; 0: not known, or all of the format. */
int
said_bits (const PairStream &stream, GstBuffer *frame)
{
  const auto meta = get_frame_meta (frame);
  if (meta && meta->bits > 0)
    return meta->bits;
  return stream.setup ? stream.setup->bits : 0;
}

std::string
depth_text (const PairStream &stream, int bits)
{
  std::string text =
      gst_video_format_to_string (GST_VIDEO_INFO_FORMAT (&stream.info));
  if (bits > 0)
    text += " with " + std::to_string (bits) + " bits";
  return text;
}

/* What uses partners reads their pixels as those of coded frames. False if they
 * differ, which is posted. */
bool
check_depth (GstCodedExposurePair *self, GstBuffer *coded, GstBuffer *partner)
{
  PairState &st = state (self);
  if (!st.on.caps || !st.off.caps)
    return true;
  const int bits = said_bits (st.on, coded);
  const int other = said_bits (st.off, partner);
  if (GST_VIDEO_INFO_FORMAT (&st.on.info) ==
          GST_VIDEO_INFO_FORMAT (&st.off.info) &&
      (bits == 0 || other == 0 || bits == other))
    return true;
  POST_ERROR (self, STREAM, FORMAT,
      "The frames of the first camera are " + depth_text (st.on, bits) +
          ", and those of the second are " + depth_text (st.off, other) +
          ". Set both cameras to the same pixel format.");
  st.refused = true;
  return false;
}

/* A frame of the second camera that is no partner. */
void
drop_next (GstCodedExposurePair *self)
{
  const BufferPtr frame (gst_aggregator_pad_pop_buffer (sink (self, "off")));
  if (!frame)
    return;
  locked (self, [&] { return ++state (self).counters.dropped; });
  take_alone (self, frame.get (), true);
}

/* The partner of @coded, the next frame of the first camera; null: it has none.
 * Nothing: it may still come, and is waited for unless it is @late. */
std::optional<BufferPtr>
take_partner (GstCodedExposurePair *self, GstBuffer *coded, bool late)
{
  GstAggregatorPad *off = sink (self, "off");
  const Instant start = instant_of (sink (self, "on"), coded);
  const auto slack =
      GstClockTimeDiff (period_of (state (self).on.info, coded) / 4);
  while (const BufferPtr next{gst_aggregator_pad_peek_buffer (off)}) {
    const auto late_by = later_by (instant_of (off, next.get ()), start);
    if (late_by && *late_by > slack)
      return nullptr;
    if (late_by && *late_by >= -slack)
      return BufferPtr (gst_aggregator_pad_pop_buffer (off));
    drop_next (self);
  }
  if (late || gst_aggregator_pad_is_eos (off))
    return nullptr;
  return std::nullopt;
}

GstFlowReturn
push (GstCodedExposurePair *self, BufferPtr coded, BufferPtr partner)
{
  const Judgement judged = judge (self, coded.get (), partner.get ());
  if (!judged.alone) {
    if (!shows_pattern (coded.get ()))
      watch_drift (self, coded.get (), partner.get ());
    coded.reset (gst_buffer_make_writable (coded.release ()));
    GstCaps *caps = state (self).off.caps.get ();
    set_partner (coded.get (),
        {std::move (partner), CapsPtr (caps ? gst_caps_ref (caps) : nullptr)});
  }
  count (self, coded.get (), judged);
  auto *aggregator = GST_AGGREGATOR (self);
  auto *src = GST_AGGREGATOR_PAD (GST_AGGREGATOR_SRC_PAD (aggregator));
  locked (src,
      [&] { return src->segment.position = GST_BUFFER_PTS (coded.get ()); });
  return gst_aggregator_finish_buffer (aggregator, coded.release ());
}

GstFlowReturn
aggregate (GstAggregator *aggregator, gboolean late)
{
  auto *self = as<GstCodedExposurePair> (aggregator);
  GstAggregatorPad *on = sink (self, "on");
  if (state (self).refused)
    return GST_FLOW_ERROR;
  const BufferPtr head (gst_aggregator_pad_peek_buffer (on));
  const bool is_silent = state (self).is_silent;
  if (!head && !gst_aggregator_pad_is_eos (on)) {
    if (late && is_silent)
      drop_next (self); // it waited until now
    return GST_AGGREGATOR_FLOW_NEED_DATA;
  }
  if (!head)
    return end (self);
  auto partner = take_partner (self, head.get (), late && !is_silent);
  if (!partner)
    return GST_AGGREGATOR_FLOW_NEED_DATA;
  if (*partner && !check_depth (self, head.get (), partner->get ()))
    return GST_FLOW_ERROR;
  BufferPtr coded (gst_aggregator_pad_pop_buffer (on));
  return coded ? push (self, std::move (coded), *std::move (partner))
               : GST_AGGREGATOR_FLOW_NEED_DATA;
}

/* Of a coded frame that waits, or else of one of the second camera. */
GstClockTime
next_time (GstAggregator *aggregator)
{
  bool &is_silent = state (aggregator).is_silent;
  is_silent = !gst_aggregator_pad_has_buffer (sink (aggregator, "on"));
  GstAggregatorPad *pad = sink (aggregator, is_silent ? "off" : "on");
  const BufferPtr head (gst_aggregator_pad_peek_buffer (pad));
  const GstClockTime time =
      head ? running_time (segment_at (pad), GST_BUFFER_PTS (head.get ()))
           : GST_CLOCK_TIME_NONE;
  return is_silent && GST_CLOCK_TIME_IS_VALID (time) ? time + kPatience : time;
}

GstFlowReturn
update_caps (GstAggregator *aggregator, GstCaps *, GstCaps **made)
{
  GstCaps *caps = state (aggregator).on.caps.get ();
  if (!caps)
    return GST_AGGREGATOR_FLOW_NEED_DATA;
  *made = gst_caps_ref (caps);
  return GST_FLOW_OK;
}

/* What was counted can be read until the next run begins. */
gboolean
start (GstAggregator *aggregator)
{
  PairState &st = state (aggregator);
  const ObjectLock lock (aggregator);
  st.counters = {};
  st.shift = kUnknown;
  return TRUE;
}

gboolean
stop (GstAggregator *aggregator)
{
  static_cast<Run &> (state (aggregator)) = {};
  return TRUE;
}

PropertyTable<PairState>
properties ()
{
  const auto counter = [] (const char *name, const char *nick,
                           const char *blurb, guint64 Counters::*member) {
    return Property<PairState> (name, nick, blurb, kReadOnly,
        within (&PairState::counters, member), guint64 (0),
        guint64 (G_MAXINT64));
  };
  const auto drift = [] (const char *name, const char *nick, const char *blurb,
                         double (*read) (const PartnerDrift::Shift &)) {
    return Property<PairState> (
        name, nick, blurb, kReadOnly,
        [read] (const PairState &st) { return read (st.shift); }, -G_MAXDOUBLE,
        G_MAXDOUBLE);
  };
  return {counter ("frames-paired", "Frames paired",
              "Coded frames that got a partner", &Counters::paired),
      counter ("pairs-confirmed", "Pairs confirmed",
          "Of these, pairs whose pixels show that they are of one exposure; of "
          "the others it is not known, as nothing moved or could be compared",
          &Counters::confirmed),
      counter ("frames-alone", "Frames alone",
          "Coded frames that passed without a partner", &Counters::alone),
      counter ("pairs-refused", "Pairs refused",
          "Coded frames whose partner is of another exposure, by its pixels; "
          "they passed alone",
          &Counters::refused),
      counter ("partners-dropped", "Partners dropped",
          "Frames of the second camera that belong to no coded frame",
          &Counters::dropped),
      drift ("drift-x", "Drift along rows",
          "By how many mirrors the second camera sees the mirrors elsewhere "
          "than its mapping has them, where that is worst, to the right",
          [] (const PartnerDrift::Shift &shift) { return shift.by.x; }),
      drift ("drift-y", "Drift along columns", "The same as drift-x, downwards",
          [] (const PartnerDrift::Shift &shift) { return shift.by.y; }),
      drift ("drift-uncertainty", "Uncertainty of the drift",
          "Standard deviation of drift-x and drift-y, mirrors; "
          "infinite while they are not known",
          [] (const PartnerDrift::Shift &shift) { return shift.uncertainty; })};
}

void
set_up (gpointer klass)
{
  GST_DEBUG_CATEGORY_INIT (codedexposure_pair_debug, "codedexposure-pair", 0,
      "coded frames and their partners");
  install_state<GstCodedExposurePair, properties> (klass);
  auto *aggregator = GST_AGGREGATOR_CLASS (klass);
  aggregator->aggregate = GST_DEBUG_FUNCPTR (aggregate);
  aggregator->get_next_time = GST_DEBUG_FUNCPTR (next_time);
  aggregator->update_src_caps = GST_DEBUG_FUNCPTR (update_caps);
  aggregator->sink_event = GST_DEBUG_FUNCPTR (sink_event);
  aggregator->sink_query = GST_DEBUG_FUNCPTR (sink_query);
  aggregator->src_event = GST_DEBUG_FUNCPTR (src_event);
  aggregator->src_query = GST_DEBUG_FUNCPTR (src_query);
  aggregator->flush = GST_DEBUG_FUNCPTR (flush);
  aggregator->start = GST_DEBUG_FUNCPTR (start);
  aggregator->stop = GST_DEBUG_FUNCPTR (stop);
  for (const char *name : {"on", "off"})
    add_pad_template (klass, name,
        {.type = GST_TYPE_AGGREGATOR_PAD, .direction = GST_PAD_SINK});
  add_pad_template (klass, "src", {.type = GST_TYPE_AGGREGATOR_PAD});
  describe_element (klass, "Coded exposure pairs", "Filter/Video",
      "Gives coded frames the frames of a second camera, in the beam of the "
      "mirrors that are off, that were exposed at the same time",
      {});
}

void
set_up_instance (GstCodedExposurePair *self)
{
  for (const char *name : {"on", "off"}) {
    GstPadTemplate *pad_template =
        gst_element_class_get_pad_template (GST_ELEMENT_GET_CLASS (self), name);
    gst_element_add_pad (GST_ELEMENT (self),
        GST_PAD (g_object_new (GST_TYPE_AGGREGATOR_PAD, "name", name,
            "direction", GST_PAD_SINK, "template", pad_template, nullptr)));
  }
  gst_pad_add_probe (GST_AGGREGATOR_SRC_PAD (self), GST_PAD_PROBE_TYPE_BUFFER,
      before_frame, self, nullptr);
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (codedexposure_pair, "codedexposure-pair",
    GST_RANK_NONE,
    (type_of<GstCodedExposurePair, set_up, set_up_instance> (
        "GstCodedExposurePair", GST_TYPE_AGGREGATOR)))

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* GstCodedFilter: counts and reports coded frames; pushes pictures. */
#include "coded_filter.h"

#include <algorithm>
#include <cstdlib>
#include <thread>
#include <utility>

#include "extract/black_level.h"
#include "record.h"

#define GST_CAT_DEFAULT coded_filter_debug

namespace codedexposure::gst
{

namespace
{

bool
ends_with_stream (GstPad *sinkpad, GstClockTime stop)
{
  gint64 duration = -1;
  return gst_pad_peer_query_duration (sinkpad, GST_FORMAT_TIME, &duration) &&
         GstClockTime (duration) <= stop + kRounding;
}

/* A seek leaves out frames that nobody counts. */
void
count_from_seek (FrameSequence &sequence, const GstSegment &upstream,
    GstBuffer *frame, GstClockTime period)
{
  guint64 position = 0;
  if (upstream.rate > 0 && !get_frame_meta (frame) &&
      gst_segment_to_stream_time_full (
          &upstream, GST_FORMAT_TIME, GST_BUFFER_PTS (frame), &position) > 0)
    sequence.go_to ((position + period / 2) / period);
}

} // namespace

/* The first frames of a camera come less than a period apart, until its clock
 * is known. Pictures that would then not be later than the last one of the
 * frame before follow right after it; the others keep their times. */
GstClockTime
CodedFrame::pts_of (int k, int n, FrameRate rate) const
{
  const auto own = [&] (int i) {
    return pts () + GstClockTime (rate.time_of (0, i, n));
  };
  if (!GST_CLOCK_TIME_IS_VALID (before.pts) || pts () <= before.pts)
    return own (k);
  const GstClockTime last =
      before.pts + GstClockTime (before.rate.time_of (0, n - 1, n));
  if (own (k) > last)
    return own (k);
  int late = k + 1;
  while (own (late) <= last)
    late++;
  const GstClockTime most = GstClockTime (rate.period ()) / (4 * n * n);
  return last + (k + 1) * std::min (most, (own (late) - last) / (late + 1));
}

GstFlowReturn
CodedFilter::chain (BufferPtr frame)
{
  GST_LOG_OBJECT (sinkpad_, "[IN] %" GST_PTR_FORMAT, frame.get ());
  GstFlowReturn flow = check_time_stamp (frame.get ());
  /* Another schedule is not that of the pictures that were asked for. */
  if (flow == GST_FLOW_OK && stream_.stale && is_past (frame.get ()))
    return drain ();
  if (flow == GST_FLOW_OK)
    flow = negotiate (frame.get ());
  if (flow == GST_FLOW_OK && stream_.excerpt)
    count_from_seek (
        *stream_.sequence, stream_.upstream, frame.get (), format ().period ());
  if (flow == GST_FLOW_OK)
    frame = restore_clipped_frame (std::move (frame));
  if (flow != GST_FLOW_OK || !frame)
    return flow;
  CodedFrame coded = admit (std::move (frame));
  if (!coded.follows)
    flow = break_off ();
  if (flow != GST_FLOW_OK)
    return flow;
  if (coded.place == Place::inside)
    include (coded);
  else if (coded.place == Place::early)
    each_pad ([] (GstCodedPad *pad) { pad->state.discont = false; });
  if (coded.place == Place::inside && coded.meta.pattern.empty ())
    flow = push_coded (coded);
  if (is_fatal (flow))
    return flow;
  if (!coded.meta.pattern.empty ())
    return skip (coded);
  stream_.pattern.clear ();
  return coded.place == Place::inside ? process (std::move (coded))
                                      : learn (std::move (coded));
}

bool
CodedFilter::is_past (GstBuffer *frame) const
{
  return stream_.excerpt && has_format () &&
         stream_.excerpt->place (GST_BUFFER_PTS (frame), format ().period ()) ==
             Place::past;
}

/* This pad comes first, because the recorder of coded frames must not wait for
 * a display of pictures. */
GstFlowReturn
CodedFilter::push_coded (const CodedFrame &frame)
{
  const auto served = pads ();
  GstCodedPad *pad = find_pad (*served, PadKind::coded);
  if (!pad)
    return GST_FLOW_OK;
  BufferPtr outbuf (gst_buffer_ref (frame.buffer.get ()));
  if (std::exchange (pad->state.discont, false) &&
      !GST_BUFFER_IS_DISCONT (outbuf.get ())) {
    outbuf.reset (gst_buffer_make_writable (outbuf.release ()));
    GST_BUFFER_FLAG_SET (outbuf.get (), GST_BUFFER_FLAG_DISCONT);
  }
  GST_LOG_OBJECT (pad, "[OUT] %" GST_PTR_FORMAT, outbuf.get ());
  return combine_flow (pad, gst_pad_push (GST_PAD (pad), outbuf.release ()));
}

/* The segment of an excerpt goes downstream with its first frame, and changes
 * if a frame does not end within it. */
void
CodedFilter::include (const CodedFrame &frame)
{
  if (!stream_.excerpt)
    return;
  const bool changed = stream_.excerpt->include (
      stream_.segment, frame.pts (), format ().period ());
  if (!awaits_excerpt ()) {
    if (changed)
      forward (segment_event ());
    return;
  }
  if (const auto made = provenance (); made->first_frame != frame.meta.frame) {
    Provenance own = *made;
    own.first_frame = frame.meta.frame;
    stream_.provenance_due = true;
    const ObjectLock lock (element_);
    shared_.provenance = std::make_shared<const Provenance> (std::move (own));
  }
  settle_events ();
  push_provenance ();
}

/* A frame that does not show the schedule: a GAP takes the place of its
 * pictures. */
GstFlowReturn
CodedFilter::skip (const CodedFrame &frame)
{
  const std::string &pattern = frame.meta.pattern;
  if (frame.place != Place::inside) {
    const GstFlowReturn flow = drain ();
    break_history ();
    each_pad ([] (GstCodedPad *pad) {
      pad->state.discont = pad->state.kind != PadKind::coded;
    });
    return flow;
  }
  count (&CodedCounters::frames_not_coded);
  notify ("stats");
  if (pattern != stream_.pattern &&
      (pattern != kSwitch || stream_.pattern.empty ())) {
    stream_.pattern = pattern;
    post_message (element_, NotCoded{pattern, frame.meta.frame, frame.pts ()});
  }
  const GstFlowReturn flow = drain ();
  break_history ();
  if (flow != GST_FLOW_OK)
    return flow;
  const EventPtr gap (gst_event_new_gap (frame.pts (), format ().period ()));
  each_pad ([&] (GstCodedPad *pad) {
    if (pad->state.kind == PadKind::coded)
      return;
    pad->state.discont = true;
    gst_pad_push_event (GST_PAD (pad), gap_for (pad, gap.get ()).release ());
  });
  return push_coded (frame);
}

/* The next frame does not follow the last one. */
GstFlowReturn
CodedFilter::break_off ()
{
  const GstFlowReturn flow = drain ();
  break_history ();
  each_pad ([] (GstCodedPad *pad) { pad->state.discont = true; });
  return flow;
}

GstFlowReturn
CodedFilter::check_time_stamp (GstBuffer *frame) const
{
  if (stream_.segment.format != GST_FORMAT_TIME)
    return GST_FLOW_ERROR;
  const GstClockTime pts = GST_BUFFER_PTS (frame);
  if (pts <= GstClockTime (kFarthestTime))
    return GST_FLOW_OK;
  post_error (
      GST_CLOCK_TIME_IS_VALID (pts)
          ? too_far_text (pts)
          : "A coded frame has no time stamp (PTS). Let the source set one, "
            "for example with do-timestamp=true.");
  return GST_FLOW_ERROR;
}

/* Decoders clip the times of the first frame of a segment: its PTS becomes the
 * start of the segment, its DURATION the rest of the period. Returns the frame
 * with its original times. Null if only a rounding error is left of it, or,
 * with a warning, if it seems to be clipped at both ends, so that its start is
 * unknown. No frame starts before 0, and a clipped one keeps a DURATION: others
 * with a DURATION that is too short are whole. */
BufferPtr
CodedFilter::restore_clipped_frame (BufferPtr frame)
{
  const GstClockTime period = format ().period ();
  const GstClockTime pts = GST_BUFFER_PTS (frame.get ());
  const GstClockTime duration = GST_BUFFER_DURATION (frame.get ());
  if (!GST_CLOCK_TIME_IS_VALID (duration) || duration == 0 ||
      duration + kRounding >= period)
    return frame;
  const bool at_start = pts == stream_.upstream.start;
  const bool at_stop = pts + duration == stream_.upstream.stop;
  if (at_stop && !at_start && duration <= kRounding)
    return nullptr;
  if (!at_start || pts + duration < period)
    return frame;
  if (duration <= kRounding) {
    /* If it was whole after all, the frames after it show that it is lost. */
    stream_.last_pts = pts + duration - period;
    stream_.sequence->take (Nanoseconds (stream_.last_pts), backwards ());
    return nullptr;
  }
  if (at_stop && !ends_with_stream (sinkpad_, stream_.upstream.stop)) {
    GST_ELEMENT_WARNING (element_, STREAM, FORMAT,
        ("From %" GST_TIME_FORMAT " to %" GST_TIME_FORMAT
         " there is only a part of one coded frame, whose start is not known; "
         "it is dropped. Seek to a longer segment.",
            GST_TIME_ARGS (stream_.upstream.start),
            GST_TIME_ARGS (stream_.upstream.stop)),
        (nullptr));
    return nullptr;
  }
  BufferPtr whole (gst_buffer_make_writable (frame.release ()));
  GST_BUFFER_PTS (whole.get ()) = pts + duration - period;
  GST_BUFFER_DURATION (whole.get ()) = period;
  return whole;
}

void
CodedFilter::count (guint64 CodedCounters::*counter, guint64 by)
{
  const ObjectLock lock (element_);
  shared_.counters.*counter += by;
}

/* How a frame of a recording differs from what was recorded, because an element
 * changed it since; null: it does not, or that is not known. Copies and changed
 * times lie apart from their exposure. */
const char *
CodedFilter::edit_of (GstBuffer *frame, const std::optional<FrameMeta> &meta)
{
  if (!meta)
    return stream_.is_recorded ? "metadata" : nullptr;
  if (!meta->hash)
    return nullptr;
  if (hash_of (frame, format ().info) != meta->hash)
    return "pixels";
  if (!GST_CLOCK_TIME_IS_VALID (meta->exposure_start))
    return nullptr;
  const GstClockTimeDiff moved =
      GST_CLOCK_DIFF (meta->exposure_start, GST_BUFFER_PTS (frame));
  const GstClockTimeDiff before = stream_.moved.value_or (moved);
  stream_.moved = before;
  const auto slack = GstClockTimeDiff (format ().period () / 16);
  return std::abs (moved - before) > slack ? "times" : nullptr;
}

void
CodedFilter::flag_edited (
    BufferPtr &frame, const std::optional<FrameMeta> &meta)
{
  const char *edited = edit_of (frame.get (), meta);
  if (!edited)
    return;
  frame.reset (gst_buffer_make_writable (frame.release ()));
  GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_CORRUPTED);
  if (!std::exchange (stream_.warned_of_edit, true))
    POST_WARNING (element_, STREAM, FORMAT,
        std::string ("The coded frames have other ") + edited +
            " than when they were recorded: an element between the recording "
            "and this one changes them. Their pictures are flagged as "
            "corrupted. Decode the frames as they were recorded.");
}

/* Numbers the frame by its time; counts and reports lost and corrupted frames.
 */
CodedFrame
CodedFilter::admit (BufferPtr frame)
{
  const GstClockTime pts = GST_BUFFER_PTS (frame.get ());
  const Place place = stream_.excerpt
                          ? stream_.excerpt->place (pts, format ().period ())
                          : Place::inside;
  const bool counts = place == Place::inside;
  const auto known = get_frame_meta (frame.get ());
  flag_edited (frame, known);
  if (counts)
    count (&CodedCounters::frames_in);
  if (counts &&
      GST_BUFFER_FLAG_IS_SET (frame.get (), GST_BUFFER_FLAG_CORRUPTED)) {
    count (&CodedCounters::frames_corrupted);
    notify ("stats");
  }
  FrameStep step = stream_.sequence->take (Nanoseconds (pts), backwards ());
  if (step.arrival == Arrival::behind)
    step = stream_.sequence->restart (Nanoseconds (pts));
  FrameMeta counted;
  counted.frame = step.number;
  if (counts && step.arrival == Arrival::after_loss)
    report_loss (pts, step.lost, known ? known->lost_before : 0);
  else if (counts && step.arrival != Arrival::next &&
           step.arrival != Arrival::first)
    warn_of_wrong_time (pts);
  if (counts && step.arrival == Arrival::late) {
    const ObjectLock lock (element_);
    guint64 &lost = shared_.counters.frames_lost;
    lost -= std::min<guint64> (lost, 1);
  }
  stream_.last_pts = pts;
  const bool after_late =
      std::exchange (stream_.was_late, step.arrival == Arrival::late);
  const bool follows = step.arrival == Arrival::next && !after_late &&
                       !GST_BUFFER_IS_DISCONT (frame.get ());
  counted.lost_before = step.lost;
  return {std::move (frame), known.value_or (counted), follows, place,
      std::exchange (stream_.before, {pts, format ().rate})};
}

void
CodedFilter::note_missing (GstEvent *gap)
{
  GstClockTime pts, duration;
  GstGapFlags flags;
  gst_event_parse_gap (gap, &pts, &duration);
  gst_event_parse_gap_flags (gap, &flags);
  if (flags & GST_GAP_FLAG_MISSING_DATA && GST_CLOCK_TIME_IS_VALID (duration))
    stream_.missing_until = pts + duration;
}

/* The element that says where frames are missing, by a GAP event or, as @told,
 * in the meta of the frame after them, has posted the loss. */
void
CodedFilter::report_loss (GstClockTime pts, guint64 lost, guint64 told)
{
  const GstClockTime period = format ().period ();
  const GstClockTime last = stream_.last_pts;
  const GstClockTime from =
      backwards () ? last - std::min (last, period) : last + period;
  GST_WARNING_OBJECT (element_,
      "%" G_GUINT64_FORMAT " coded frames lost from %" GST_TIME_FORMAT
      " to %" GST_TIME_FORMAT,
      lost, GST_TIME_ARGS (from), GST_TIME_ARGS (pts));
  count (&CodedCounters::frames_lost, lost);
  const bool posted = told >= lost && !backwards ();
  if (!posted && stream_.missing_until + period / 2 < pts)
    post_message (element_, FramesLost{lost, from, pts});
  notify ("stats");
}

void
CodedFilter::warn_of_wrong_time (GstClockTime pts)
{
  if (std::exchange (stream_.warned_of_time, true))
    return;
  GST_ELEMENT_WARNING (element_, STREAM, FORMAT,
      ("A coded frame at %" GST_TIME_FORMAT " follows one at %" GST_TIME_FORMAT
       ", but frames are %" GST_TIME_FORMAT
       " apart. Its time overlaps with that of others.",
          GST_TIME_ARGS (pts), GST_TIME_ARGS (stream_.last_pts),
          GST_TIME_ARGS (format ().period ())),
      ("posted once a stream"));
}

void
CodedFilter::note_saturation (const CodedFrame &frame)
{
  /* Noise makes a bright pixel saturate in one frame and not in the next. */
  constexpr GstClockTimeDiff kCalm = GST_SECOND;
  if (GST_BUFFER_FLAG_IS_SET (frame.buffer.get (), GST_BUFFER_FLAG_GAP) ||
      frame.place != Place::inside)
    return;
  const GstClockTime pts = frame.pts ();
  std::optional<Saturated> &burst = stream_.saturation;
  if (frame.meta.saturated == 0) {
    if (burst && std::abs (GST_CLOCK_DIFF (*burst->to, pts)) >= kCalm)
      end_saturation ();
    return;
  }
  count (&CodedCounters::saturated_frames);
  const bool begins = !burst;
  if (begins)
    burst = Saturated{.frames = 0, .from = pts};
  ++*burst->frames;
  burst->to = pts;
  burst->pixels = std::max (burst->pixels, frame.meta.saturated);
  if (!begins)
    return;
  post_message (element_, Saturated{.active = true,
                              .frame = frame.meta.frame,
                              .from = pts,
                              .pixels = frame.meta.saturated});
  notify ("stats");
}

void
CodedFilter::end_saturation ()
{
  const auto burst = std::exchange (stream_.saturation, std::nullopt);
  if (!burst)
    return;
  post_message (element_, *burst);
  notify ("stats");
}

MappedFrame
CodedFilter::map_coded (GstBuffer *frame) const
{
  const GstVideoInfo &info = format ().info;
  MappedFrame coded (info, frame, GST_MAP_READ);
  if (!coded)
    post_error (unreadable_text (info, frame));
  return coded;
}

Workers &
CodedFilter::rectify_workers ()
{
  constexpr int kRowsOfAThread = 64;
  if (!stream_.workers) {
    const int most = std::clamp (format ().size.height / kRowsOfAThread, 1,
        std::max (int (std::thread::hardware_concurrency ()), 1));
    const int wanted = threads ();
    stream_.workers =
        std::make_unique<Workers> (wanted > 0 ? std::min (wanted, most) : most);
  }
  return *stream_.workers;
}

template <typename Pixel>
Result<ImageView<const Pixel>>
CodedFilter::light_of (ImageView<const Pixel> coded, Image<float> *errors)
{
  const int bits = significant_bits ();
  if (const int black = bench () ? bench ()->black () : 0; black > 0) {
    auto &light = image_in<Pixel> (stream_.light, {coded.width, coded.height});
    subtract_black (coded, black, bits, light.view ());
    coded = light.view ();
  }
  const Rectifier *rectifier = format ().rectifier.get ();
  if (!rectifier)
    return coded;
  return rectify (
      *rectifier, coded, bits, stream_.rectified, errors, &rectify_workers ());
}

template Result<ImageView<const std::uint8_t>> CodedFilter::light_of (
    ImageView<const std::uint8_t>, Image<float> *);
template Result<ImageView<const std::uint16_t>> CodedFilter::light_of (
    ImageView<const std::uint16_t>, Image<float> *);

/* A seek may begin or end within a coded frame. */
bool
CodedFilter::is_within (GstClockTime pts, GstClockTime duration) const
{
  guint64 from, to;
  return gst_segment_clip (
             &segment (), GST_FORMAT_TIME, pts, pts + duration, &from, &to) &&
         to - from > std::min (kRounding, duration / 2);
}

GstFlowReturn
CodedFilter::acquire_picture (GstCodedPad *pad, const GstVideoInfo &info,
    bool first, BufferPtr &buffer, MappedFrame &mapped) const
{
  const GstFlowReturn flow = acquire (pad, info, first, buffer);
  if (flow == GST_FLOW_FLUSHING)
    return flow;
  if (buffer)
    mapped.map (info, buffer.get (), GST_MAP_WRITE);
  if (buffer && mapped)
    return GST_FLOW_OK;
  GST_ELEMENT_ERROR (element_, RESOURCE, NO_SPACE_LEFT,
      ("No buffer for a picture of %dx%d pixels.", info.width, info.height),
      ("pool %" GST_PTR_FORMAT, pad->state.allocation->pool.get ()));
  return GST_FLOW_ERROR;
}

void
CodedFilter::describe (GstBuffer *outbuf, GstBuffer *coded, FrameMeta meta,
    const Picture &picture) const
{
  gst_buffer_copy_into (outbuf, coded, GST_BUFFER_COPY_FLAGS, 0, -1);
  GST_BUFFER_FLAG_UNSET (outbuf, GST_BUFFER_FLAG_MARKER);
  if (picture.of_region)
    copy_metas_to_part (coded, outbuf);
  else
    copy_metas (coded, format ().info, outbuf, picture.info);

  meta.subframe = picture.index;
  meta.bits = picture.has_all_bits
                  ? 0
                  : significant_bits_of (significant_bits (), picture.info);
  meta.exposure_start = picture.exposure_start;
  meta.exposure_duration = picture.exposure_duration;
  meta.hash.reset ();
  set_frame_meta (outbuf, meta);
  GST_BUFFER_PTS (outbuf) = picture.pts;
  GST_BUFFER_DTS (outbuf) = GST_CLOCK_TIME_NONE;
}

GstFlowReturn
CodedFilter::push (GstCodedPad *pad, BufferPtr outbuf, GstClockTime duration)
{
  const GstFlowReturn flow = push_picture (pad, std::move (outbuf), duration);
  if (flow == GST_FLOW_OK)
    count (&CodedCounters::pictures_out);
  return flow;
}

GstFlowReturn
CodedFilter::combine_flow (GstCodedPad *pad, GstFlowReturn flow)
{
  const ObjectLock lock (element_);
  if (pad->state.released)
    return GST_FLOW_OK;
  return gst_flow_combiner_update_pad_flow (
      combiner_.get (), GST_PAD (pad), flow);
}

} // namespace codedexposure::gst

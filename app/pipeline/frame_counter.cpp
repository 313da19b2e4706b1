/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "frame_counter.h"

#include <utility>

#include "common/tag.h"
#include "pipeline/pads.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* Gives the first frame behind @element, and what follows, the running time
 * that @wanted says. A frame without a time is not the first.
 *
 * Only the thread that pushes through the pad can do it: in any other one, a
 * SEGMENT on its way counts as sent afterwards, without the offset. */
void
shift_first (
    GstElement *element, std::function<GstClockTime (GstBuffer *)> wanted)
{
  add_probe (pad_of (element, "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
      [wanted = std::move (wanted)] (GstPad *pad, GstPadProbeInfo *info) {
        GstBuffer *frame = GST_PAD_PROBE_INFO_BUFFER (info);
        const auto segment = segment_at (pad);
        const guint64 running = gst_segment_to_running_time (
            &*segment, GST_FORMAT_TIME, GST_BUFFER_PTS (frame));
        if (!GST_CLOCK_TIME_IS_VALID (running))
          return GST_PAD_PROBE_OK;
        gst_pad_set_offset (pad, gint64 (wanted (frame)) - gint64 (running));
        return GST_PAD_PROBE_REMOVE;
      });
}

} // namespace

void
begin_at_zero (GstElement *element)
{
  shift_first (element, [] (GstBuffer *) { return 0; });
}

/* Otherwise, those of a part of a recording would begin at 0. */
void
keep_times (GstElement *element)
{
  shift_first (
      element, [] (GstBuffer *frame) { return GST_BUFFER_PTS (frame); });
}

FrameCounter::FrameCounter (ObjectPtr<GstPad> sink, const PlayTimes &times,
    std::function<void ()> cannot_seek)
    : pad_ (std::move (sink)), times_ (times),
      cannot_seek_ (std::move (cannot_seek))
{
  if (times.is_part ())
    hold_first_frame ();
  /* Otherwise, a receiver that joins late would show frames late. */
  if (times.shift_to)
    shift_first (
        element ().get (), [to = *times.shift_to] (GstBuffer *) { return to; });
  add_probe (pad (), GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
      [this] (GstPad *, GstPadProbeInfo *info) {
        GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
        const auto setup = GST_EVENT_TYPE (event) == GST_EVENT_TAG
                               ? setup_from_tags (tags_of (event))
                               : std::nullopt;
        if (setup && *setup)
          tagged_ = setup->value ().schedule.text ();
        return GST_PAD_PROBE_OK;
      });
  watch_buffers (
      pad (), [this] (GstPad *, GstBuffer *frame) { count (frame); });
}

FrameCounter::~FrameCounter ()
{
  g_idle_remove_by_data (this);
}

double
FrameCounter::done (gint64 total) const
{
  gint64 length = 0;
  if (total > 0)
    return double (frames_) / double (total);
  if (last_ < 0)
    return 0;
  const double start = double (times_.start.value_or (0));
  const double last = double (last_);
  if (times_.stop)
    return (last - start) / (double (*times_.stop) - start);
  if (gst_pad_peer_query_duration (pad (), GST_FORMAT_TIME, &length) &&
      double (length) > start)
    return (last - start) / (double (length) - start);
  return 0;
}

ObjectPtr<GstElement>
FrameCounter::element () const
{
  return ObjectPtr<GstElement> (gst_pad_get_parent_element (pad ()));
}

void
FrameCounter::end ()
{
  /* A pad that is full takes the end later. */
  const auto send = [] (GstElement *, gpointer pad) {
    gst_pad_send_event (GST_PAD (pad), gst_event_new_eos ());
  };
  gst_element_call_async (
      element ().get (), send, gst_object_ref (pad ()), gst_object_unref);
}

/* No file is started and nothing is shown before the seek. */
void
FrameCounter::hold_first_frame ()
{
  hold_ =
      add_probe (pad (), GST_PAD_PROBE_TYPE_BLOCK | GST_PAD_PROBE_TYPE_BUFFER,
          [this, held = false] (GstPad *, GstPadProbeInfo *) mutable {
            const auto on_held = [] (gpointer self) {
              static_cast<FrameCounter *> (self)->seek ();
              return gboolean (G_SOURCE_REMOVE);
            };
            if (!std::exchange (held, true))
              g_idle_add (on_held, this);
            return GST_PAD_PROBE_OK;
          });
}

/* It is sent to the element that decodes, because muxers do not pass it on. */
void
FrameCounter::seek ()
{
  if (!gst_element_send_event (element ().get (),
          gst_event_new_seek (1.0, GST_FORMAT_TIME,
              GstSeekFlags (GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
              GST_SEEK_TYPE_SET, gint64 (times_.start.value_or (0)),
              times_.stop ? GST_SEEK_TYPE_SET : GST_SEEK_TYPE_NONE,
              times_.stop ? gint64 (*times_.stop) : -1)))
    cannot_seek_ ();
  gst_pad_remove_probe (pad (), std::exchange (hold_, 0));
}

/* Frames around the part are only read. The time of the first one may be
 * rounded to one before 0. */
void
FrameCounter::count (GstBuffer *frame)
{
  const auto segment = segment_at (pad ());
  guint64 time = 0;
  const GstClockTime position =
      gst_segment_to_stream_time_full (
          &*segment, GST_FORMAT_TIME, GST_BUFFER_PTS (frame), &time) > 0
          ? time
          : 0;
  if (!times_.holds (position))
    return;
  frames_++;
  last_ = gint64 (position);
  follow_schedule ();
}

void
FrameCounter::follow_schedule ()
{
  if (tagged_ == schedule_)
    return;
  const std::string before = std::exchange (schedule_, tagged_);
  const std::lock_guard lock (mutex_);
  if (!before.empty ())
    change_ = "from " + before + " to " + schedule_;
}

std::string
FrameCounter::schedule_change () const
{
  const std::lock_guard lock (mutex_);
  return change_;
}

} // namespace codedexposure::app

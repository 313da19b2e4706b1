/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "frame_counter.h"

#include <utility>

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* Gives @frame, at the source @pad of an element, and what follows the running
 * time @wanted. False: it has no time.
 *
 * Only in the thread that pushes through @pad: in any other one, a SEGMENT on its
 * way counts as sent afterwards, without the offset. */
bool
shift_running_time (GstPad *pad, GstBuffer *frame, GstClockTime wanted)
{
  const EventPtr sticky (gst_pad_get_sticky_event (pad, GST_EVENT_SEGMENT, 0));
  const GstSegment *segment = nullptr;
  gst_event_parse_segment (sticky.get (), &segment);
  const guint64 running = gst_segment_to_running_time (
      segment, GST_FORMAT_TIME, GST_BUFFER_PTS (frame));
  if (!GST_CLOCK_TIME_IS_VALID (running))
    return false;
  gst_pad_set_offset (pad, gint64 (wanted) - gint64 (running));
  return true;
}

void
shift_first (
    GstElement *element, GstPadProbeCallback shift, gpointer data = nullptr)
{
  const ObjectPtr<GstPad> src (gst_element_get_static_pad (element, "src"));
  gst_pad_add_probe (
      src.get (), GST_PAD_PROBE_TYPE_BUFFER, shift, data, nullptr);
}

/* Of a PTS at @pad. The first one may be rounded to a time before 0. */
GstClockTime
position_of (GstPad *pad, GstClockTime pts)
{
  const EventPtr sticky (gst_pad_get_sticky_event (pad, GST_EVENT_SEGMENT, 0));
  const GstSegment *segment = nullptr;
  gst_event_parse_segment (sticky.get (), &segment);
  guint64 time = 0;
  return gst_segment_to_stream_time_full (
             segment, GST_FORMAT_TIME, pts, &time) > 0
             ? time
             : 0;
}

} // namespace

void
begin_at_zero (GstElement *element)
{
  shift_first (element, [] (GstPad *pad, GstPadProbeInfo *info, gpointer) {
    return shift_running_time (pad, GST_PAD_PROBE_INFO_BUFFER (info), 0)
               ? GST_PAD_PROBE_REMOVE
               : GST_PAD_PROBE_OK;
  });
}

/* Otherwise, those of a part of a recording would begin at 0. */
void
keep_times (GstElement *element)
{
  shift_first (element, [] (GstPad *pad, GstPadProbeInfo *info, gpointer) {
    GstBuffer *frame = GST_PAD_PROBE_INFO_BUFFER (info);
    return shift_running_time (pad, frame, GST_BUFFER_PTS (frame))
               ? GST_PAD_PROBE_REMOVE
               : GST_PAD_PROBE_OK;
  });
}

FrameCounter::FrameCounter (ObjectPtr<GstPad> sink, const PlayTimes &times,
    std::function<void ()> cannot_seek)
    : pad_ (std::move (sink)), times_ (times),
      cannot_seek_ (std::move (cannot_seek))
{
  if (times.is_part ())
    hold_ = gst_pad_add_probe (pad (),
        GstPadProbeType (GST_PAD_PROBE_TYPE_BLOCK | GST_PAD_PROBE_TYPE_BUFFER),
        hold_first_frame, this, nullptr);
  if (times.shift_to) {
    const ObjectPtr<GstElement> element (gst_pad_get_parent_element (pad ()));
    shift_first (element.get (), shift_first_frame, this);
  }
  gst_pad_add_probe (
      pad (), GST_PAD_PROBE_TYPE_BUFFER, on_frame, this, nullptr);
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

void
FrameCounter::end ()
{
  const ObjectPtr<GstElement> element (
      gst_pad_get_parent_element (pad_.get ()));
  /* A pad that is full takes the end later. */
  const auto send = [] (GstElement *, gpointer pad) {
    gst_pad_send_event (GST_PAD (pad), gst_event_new_eos ());
  };
  gst_element_call_async (
      element.get (), send, gst_object_ref (pad_.get ()), gst_object_unref);
}

/* The first frame is held, so no file is started and nothing is shown before
 * the seek. It is sent to the element that decodes, because muxers do not pass
 * it on. */
void
FrameCounter::seek ()
{
  const ObjectPtr<GstElement> element (
      gst_pad_get_parent_element (pad_.get ()));
  if (!gst_element_send_event (element.get (),
          gst_event_new_seek (1.0, GST_FORMAT_TIME,
              GstSeekFlags (GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
              GST_SEEK_TYPE_SET, gint64 (times_.start.value_or (0)),
              times_.stop ? GST_SEEK_TYPE_SET : GST_SEEK_TYPE_NONE,
              times_.stop ? gint64 (*times_.stop) : -1)))
    cannot_seek_ ();
  gst_pad_remove_probe (pad (), std::exchange (hold_, 0));
}

gboolean
FrameCounter::on_held (gpointer self)
{
  static_cast<FrameCounter *> (self)->seek ();
  return G_SOURCE_REMOVE;
}

GstPadProbeReturn
FrameCounter::hold_first_frame (GstPad *, GstPadProbeInfo *, gpointer self)
{
  auto *counter = static_cast<FrameCounter *> (self);
  if (std::exchange (counter->held_, true))
    return GST_PAD_PROBE_OK;
  g_idle_add (on_held, self);
  return GST_PAD_PROBE_OK;
}

/* Otherwise, a receiver that joins late would show frames late. */
GstPadProbeReturn
FrameCounter::shift_first_frame (
    GstPad *pad, GstPadProbeInfo *info, gpointer self)
{
  const PlayTimes &times = static_cast<FrameCounter *> (self)->times_;
  GstBuffer *frame = GST_PAD_PROBE_INFO_BUFFER (info);
  return shift_running_time (pad, frame, *times.shift_to) ? GST_PAD_PROBE_REMOVE
                                                          : GST_PAD_PROBE_OK;
}

/* Frames around the part are only read. */
GstPadProbeReturn
FrameCounter::on_frame (GstPad *pad, GstPadProbeInfo *info, gpointer self)
{
  auto *counter = static_cast<FrameCounter *> (self);
  const GstClockTime position =
      position_of (pad, GST_BUFFER_PTS (GST_PAD_PROBE_INFO_BUFFER (info)));
  if (!counter->times_.holds (position))
    return GST_PAD_PROBE_OK;
  counter->frames_++;
  counter->last_ = gint64 (position);
  return GST_PAD_PROBE_OK;
}

} // namespace codedexposure::app

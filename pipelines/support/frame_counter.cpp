/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "frame_counter.h"

#include <algorithm>
#include <tuple>
#include <utility>

using namespace codedexposure::gst;

namespace
{

constexpr GstClockTime
nanoseconds (double seconds)
{
  return GstClockTime (seconds * 1e9 + 0.5);
}

/* Whether @frame ends before the time @start, which happens if a seek goes
 * beyond the end of a stream. */
bool
is_before (const GstBuffer *frame, GstClockTime start)
{
  return GST_BUFFER_PTS_IS_VALID (frame) &&
         GST_BUFFER_DURATION_IS_VALID (frame) &&
         GST_BUFFER_PTS (frame) + GST_BUFFER_DURATION (frame) <= start;
}

/* The frame period of the caps at @pad, or 0. */
GstClockTime
frame_period (GstPad *pad)
{
  const CapsPtr caps (gst_pad_get_current_caps (pad));
  gint num = 0, den = 1;
  if (!caps ||
      !gst_structure_get_fraction (
          gst_caps_get_structure (caps.get (), 0), "framerate", &num, &den) ||
      num <= 0)
    return 0;
  return gst_util_uint64_scale_int (GST_SECOND, den, num);
}

/* Gives @frame, at the sink @pad of an element, and what follows the running
 * time @wanted behind that element. False: it has no time. */
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
  const ObjectPtr<GstElement> element (gst_pad_get_parent_element (pad));
  const ObjectPtr<GstPad> src (
      gst_element_get_static_pad (element.get (), "src"));
  if (src)
    gst_pad_set_offset (src.get (), gint64 (wanted) - gint64 (running));
  return true;
}

} // namespace

void
begin_at_zero (GstElement *element)
{
  const ObjectPtr<GstPad> sink (gst_element_get_static_pad (element, "sink"));
  gst_pad_add_probe (
      sink.get (), GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *pad, GstPadProbeInfo *info, gpointer) {
        return shift_running_time (pad, GST_PAD_PROBE_INFO_BUFFER (info), 0)
                   ? GST_PAD_PROBE_REMOVE
                   : GST_PAD_PROBE_OK;
      },
      nullptr, nullptr);
}

FrameCounter::FrameCounter (ObjectPtr<GstPad> sink, const Times &times,
    std::function<void ()> cannot_seek)
    : pad_ (std::move (sink)), times_ (times),
      cannot_seek_ (std::move (cannot_seek))
{
  if (times.start > 0 || times.duration > 0 || times.excerpt)
    hold_ = gst_pad_add_probe (pad (),
        GstPadProbeType (GST_PAD_PROBE_TYPE_BLOCK | GST_PAD_PROBE_TYPE_BUFFER),
        hold_first_frame, this, nullptr);
  if (times.shift_to >= 0 || times.keep_time)
    gst_pad_add_probe (
        pad (), GST_PAD_PROBE_TYPE_BUFFER, shift_first_frame, this, nullptr);
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
  if (last_pts_ < 0)
    return 0;
  if (times_.excerpt && GST_CLOCK_TIME_IS_VALID (times_.excerpt->until))
    return double (last_pts_ - gint64 (times_.excerpt->from)) /
           double (times_.excerpt->until - times_.excerpt->from);
  if (times_.duration > 0)
    return (1e-9 * double (last_pts_) - times_.start) / times_.duration;
  if (gst_pad_peer_query_duration (pad (), GST_FORMAT_TIME, &length) &&
      length > 0)
    return double (last_pts_) / double (length);
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

/* The segment begins at the start of a frame and has at least one, because
 * decoders clip a coded frame to the segment and its slots would be lost. */
GstEvent *
FrameCounter::new_seek () const
{
  const GstClockTime period = frame_period (pad ());
  GstClockTime start = nanoseconds (times_.start), stop = GST_CLOCK_TIME_NONE;
  if (times_.excerpt) {
    std::tie (start, stop) = times_.excerpt->read (period);
  } else if (times_.duration > 0) {
    stop = start + std::max (nanoseconds (times_.duration), period);
  }
  return gst_event_new_seek (1.0, GST_FORMAT_TIME,
      GstSeekFlags (GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_KEY_UNIT |
                    GST_SEEK_FLAG_SNAP_BEFORE),
      GST_SEEK_TYPE_SET, gint64 (start),
      GST_CLOCK_TIME_IS_VALID (stop) ? GST_SEEK_TYPE_SET : GST_SEEK_TYPE_NONE,
      gint64 (stop));
}

/* The first frame is held, so no file is started and nothing is shown before
 * the seek. */
void
FrameCounter::seek ()
{
  if (!gst_pad_push_event (pad (), new_seek ()))
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
  if (!std::exchange (static_cast<FrameCounter *> (self)->held_, true))
    g_idle_add (on_held, self);
  return GST_PAD_PROBE_OK;
}

/* Otherwise, a receiver that joins late would show frames late, and the times
 * of a recording that is decoded would begin at 0. */
GstPadProbeReturn
FrameCounter::shift_first_frame (
    GstPad *pad, GstPadProbeInfo *info, gpointer self)
{
  const Times &times = static_cast<FrameCounter *> (self)->times_;
  GstBuffer *frame = GST_PAD_PROBE_INFO_BUFFER (info);
  return shift_running_time (pad, frame,
             times.keep_time ? GST_BUFFER_PTS (frame)
                             : nanoseconds (times.shift_to))
             ? GST_PAD_PROBE_REMOVE
             : GST_PAD_PROBE_OK;
}

GstPadProbeReturn
FrameCounter::on_frame (GstPad *, GstPadProbeInfo *info, gpointer self)
{
  auto *counter = static_cast<FrameCounter *> (self);
  const GstBuffer *frame = GST_PAD_PROBE_INFO_BUFFER (info);
  if (is_before (frame, nanoseconds (counter->times_.start)))
    return GST_PAD_PROBE_DROP;
  if (const auto &excerpt = counter->times_.excerpt;
      excerpt && !excerpt->holds (GST_BUFFER_PTS (frame)))
    return GST_PAD_PROBE_OK;
  counter->frames_++;
  if (GST_BUFFER_PTS_IS_VALID (frame))
    counter->last_pts_ = gint64 (GST_BUFFER_PTS (frame));
  return GST_PAD_PROBE_OK;
}

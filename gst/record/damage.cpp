/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The part restore: what it counts and says of damage. */
#include <algorithm>
#include <utility>

#include "common/excerpt.h"
#include "restore.h"

namespace codedexposure::gst
{

void
DamageReport::restart ()
{
  forget ();
  repeated_ = 0;
  const ObjectLock lock (element_);
  counters_ = {};
}

void
DamageReport::count (guint64 Counters::*counter, guint64 by)
{
  const ObjectLock lock (element_);
  counters_.*counter += by;
}

void
DamageReport::frame_flagged (bool known, std::optional<guint64> number,
    GstClockTime pts, const char *reason)
{
  count (known ? &Counters::frames_damaged : &Counters::frames_unknown);
  if (!open_) {
    open_ = FramesDamaged{.frame = number, .count = 0, .from = pts};
    post_message (element_,
        FramesDamaged{
            .active = true, .frame = number, .from = pts, .reason = reason});
  }
  ++*open_->count;
}

void
DamageReport::end_sequence ()
{
  if (const auto over = std::exchange (open_, std::nullopt))
    post_message (element_, *over);
}

void
DamageReport::frames_lost (const FrameRecord &record, GstClockTime pts,
    const GstSegment &segment, guint32 seqnum)
{
  const guint64 lost = record.lost_before.value_or (0);
  const GstClockTime length =
      GstClockTime (record.duration.value_or (0)) * lost;
  const GstClockTime from = pts - std::min (pts, length);
  const auto stream_time = [&segment] (GstClockTime time) {
    return gst_segment_to_stream_time (&segment, GST_FORMAT_TIME, time);
  };
  const auto asked = SeekBook::find (this, seqnum);
  const bool is_asked = !asked || (stream_time (pts) > asked->start &&
                                      stream_time (from) < asked->stop);
  if (lost > 0 && is_asked)
    post_message (element_, FramesLost{lost, from, pts});
}

void
DamageReport::frames_missing (guint64 count, GstClockTime from)
{
  if (count == 0)
    return;
  this->count (&Counters::frames_missing, count);
  post_message (element_, FramesMissing{count, from});
}

void
DamageReport::frames_missing_between (GstClockTime from, GstClockTime until,
    guint64 count, const GstSegment &segment, guint32 seqnum)
{
  const auto asked = SeekBook::find (this, seqnum);
  const auto is_asked = [&] (GstClockTime pts) {
    const guint64 time =
        gst_segment_to_stream_time (&segment, GST_FORMAT_TIME, pts);
    return !asked || (GST_CLOCK_TIME_IS_VALID (time) &&
                         time + kRounding >= asked->start &&
                         time + kRounding < asked->stop);
  };
  if (is_asked (from) && is_asked (until))
    frames_missing (count, from + (until - from) / (count + 1));
}

void
DamageReport::stream_cut ()
{
  const guint64 frames = locked (element_, [&] { return counters_.frames; });
  post_message (element_, StreamCut{frames});
}

void
DamageReport::stream_ended (guint64 total)
{
  const guint64 known = locked (element_,
      [&] { return counters_.frames - repeated_ + counters_.frames_missing; });
  if (known >= total)
    return;
  count (&Counters::frames_missing, total - known);
  post_message (element_, StreamIncomplete{total - known});
}

StructurePtr
DamageReport::stats (guint64 lines_damaged) const
{
  Counters counters = counters_;
  counters.lines_damaged = lines_damaged;
  return StructurePtr (to_structure (counters));
}

} // namespace codedexposure::gst

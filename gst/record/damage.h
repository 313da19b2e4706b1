/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the part restore counts and says of damage. */
#pragma once

#include <optional>

#include <gst/gst.h>

#include "common/messages.h"
#include "record/frame_record.h"

namespace codedexposure::gst
{

/** Counts frames for the property `stats`, and posts the messages
 * frames-damaged, at both ends of a sequence of frames that are not as
 * recorded, frames-missing, stream-cut and stream-incomplete. Streaming thread
 * of the frames. */
class DamageReport
{
public:
  explicit DamageReport (GstElement *element) : element_ (element) {}

  /** Before a run. */
  void restart ();
  /** After a flush: no sequence of damaged frames is open. */
  void forget () { open_.reset (); }

  /** Each frame, before the others. */
  void frame () { count (&Counters::frames); }
  /** At @p pts; @p reason says what is not as recorded, or why nothing is
   * @p known of it. */
  void frame_flagged (
      bool known, guint64 number, GstClockTime pts, const char *reason);
  /** It came before: another one did not. */
  void frame_repeated () { repeated_++; }
  /** Before the frame at @p pts, when @p record was made. After a seek, frames
   * around the part that was asked for are read, too: says nothing of these. */
  void frames_lost (const FrameRecord &record, GstClockTime pts,
      const GstSegment &segment, guint32 seqnum);
  /** @p count frames of the track, from @p from on, did not come; 0: says
   * nothing. */
  void frames_missing (guint64 count, GstClockTime from);
  /** The same of @p count frames without lines between two at @p from and
   * @p until, unless the gap reaches beyond the part that was asked for: then
   * it is not known how many were in it. */
  void frames_missing_between (GstClockTime from, GstClockTime until,
      guint64 count, const GstSegment &segment, guint32 seqnum);
  /** The next frame, if any, is as recorded. */
  void end_sequence ();
  /** The last line of the track did not come. */
  void stream_cut ();
  /** At the end of a stream that began with its first frame: it was to have
   * @p total frames. */
  void stream_ended (guint64 total);

  /** Object lock. */
  StructurePtr stats (guint64 lines_damaged) const;

private:
  struct Counters {
    static constexpr const char *kName =
        "application/x-codedexposure-restore-counters";
    guint64 frames = 0, frames_damaged = 0, frames_unknown = 0;
    guint64 frames_missing = 0, lines_damaged = 0;
    CODED_FIELDS (
        frames, frames_damaged, frames_unknown, frames_missing, lines_damaged);
  };
  void count (guint64 Counters::*counter, guint64 by = 1);

  GstElement *element_;
  Counters counters_; ///< object lock
  /** What is said at the end of a sequence of frames that are not as recorded.
   */
  std::optional<FramesDamaged> open_;
  guint64 repeated_ = 0;
};

} // namespace codedexposure::gst

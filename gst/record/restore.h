/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The part restore: restore.cpp brings frames and lines together,
 * track_sink.cpp takes the lines, partner_input.cpp the partners, and
 * damage.cpp reports. */
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "common/messages.h"
#include "common/raii.h"
#include "partner_input.h"
#include "record/frame_record.h"
#include "record/track_reader.h"
#include "segment.h"
#include "setup/stream_setup.h"

namespace codedexposure::gst
{

/** Which frames of a segment come, and in which order. */
TrackReader::Order order_of (const GstSegment &segment);

/** Reads the lines that come on the track's streaming thread, plain or as Pango
 * markup, and gives each frame its line. */
class TrackSink : public PadBeside<TrackSink>
{
public:
  /* Any thread: */

  /** Lines that could not be read since restart (). */
  guint64 damaged () const { return damaged_; }

  /** Before a run. */
  void restart ();

  /* Streaming thread of the frames: */

  /** The frames reach @p segment; lines before it are forgotten. */
  void next_segment (GstEvent *segment, TrackReader::Order order);
  /** After a flush. */
  void forget ();
  /** What @p use returns of the reader, to which no line comes meanwhile. Never
   * push inside. */
  template <typename Use>
  auto read (Use use)
  {
    return locked (lock_, [&] { return use (reader_); });
  }
  /** TrackReader::take (), or take_now () if the line is not waited for: then
   * there always is a match. */
  std::optional<TrackReader::Match> take (
      Nanoseconds pts, Nanoseconds start, bool wait)
  {
    return read ([=] (TrackReader &reader) {
      return wait ? reader.take (pts, start) : reader.take_now (pts, start);
    });
  }

private:
  friend PadBeside;
  GstFlowReturn chain (GstObject *, BufferPtr buffer);
  void follow (GstEvent *event);
  /** A line, or the end of the track. */
  struct Item {
    guint64 segment;
    std::optional<std::string> text;
    Nanoseconds pts = 0, duration = 0;
  };
  void add (Item item);
  void reach (SegmentCount &which, GstEvent *segment);

  std::atomic<guint64> damaged_ = 0;

  /* The lock: */
  TrackReader reader_;
  std::deque<Item> later_; ///< of segments that the frames have not reached
  bool markup_ = false;    ///< the text is escaped
};

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
  void frame_flagged (bool known, std::optional<guint64> number,
      GstClockTime pts, const char *reason);
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

/** A frame, or a serialised event that came after one that waits. */
using Item = std::variant<BufferPtr, EventPtr>;

/** What waits for the line of its first frame. */
struct HeldItems {
  std::deque<Item> items;
  bool is_first_left = false; ///< a seek came before its line

  /** Null: the first item is none. */
  GstBuffer *first_frame () const
  {
    const auto *frame =
        items.empty () ? nullptr : std::get_if<BufferPtr> (&items.front ());
    return frame ? frame->get () : nullptr;
  }
  Item take_first ()
  {
    Item item = std::move (items.front ());
    items.pop_front ();
    is_first_left = false;
    return item;
  }
  void add_left (BufferPtr frame)
  {
    items.push_back (std::move (frame));
    is_first_left = true;
  }
  /** If @p frame is the one that was left or before it, the demuxer went back,
   * and that one comes again. */
  void add (BufferPtr frame)
  {
    if (is_first_left &&
        GST_BUFFER_PTS (frame.get ()) <= GST_BUFFER_PTS (first_frame ()))
      take_first ();
    items.push_back (std::move (frame));
  }
};

/** What is forgotten before a run. Stream lock of the sink pad. */
struct Run {
  GstVideoInfo info = {};
  bool encoded = false; ///< there are no pixels to be checked
  GstSegment segment = {};
  HeldItems held;
  guint32 segment_seqnum = GST_SEQNUM_INVALID; ///< of the segment
  bool is_complete = true;                     ///< all its frames are to come
  bool is_unwanted = false; ///< no more frames are to reach downstream
  std::optional<StreamSetup> container;     ///< setup of the container's tags
  std::vector<StreamSetup> others;          ///< those before it
  std::shared_ptr<const StreamSetup> setup; ///< in force
  std::optional<guint64> last_frame;        ///< the largest number
  GstClockTime last_pts = 0;                ///< of the newest frame
  bool announced = false; ///< the container's tags say that there is a track
  bool found_line = false;
  /** No seek: the first frame is that of the stream, the last one its last. */
  bool whole = true;
  bool said_no_track = false;
  bool said_moved = false;
  bool said_setups_differ = false;
};

struct RestoreState : Run {
  explicit RestoreState (GstElement *element = nullptr) : damage (element) {}

  GstPad *sink = nullptr, *src = nullptr; ///< the element's
  guint64 tick = 1; ///< object lock; to which the container rounds times, ns
  TrackSink track;
  PartnerInput partners;
  DamageReport damage;
};

} // namespace codedexposure::gst

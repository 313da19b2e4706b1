/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The side of an element on which coded frames come in: what the user and the
 * stream say of them, which of them came, and which did not. */
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "base/result.h"
#include "clock/frame_sequence.h"
#include "gstcodedexposurecaps.h"
#include "gstcodedexposuremeta.h"
#include "gstraii.h"
#include "moire/rectifier.h"
#include "schedule/schedule.h"
#include "schedule/stream_setup.h"

namespace cexp::gst
{

using ScheduleRef = std::shared_ptr<const Schedule>;

/** What the user says of coded frames. */
struct CodedSettings {
  std::string schedule;
  /** The schedule read from the text; null where the text is empty. */
  std::shared_ptr<const Result<Schedule>> parsed;
  std::string mapping;
  /** Read from the file of that name; null where there is none. */
  std::shared_ptr<const Result<Mapping>> mapped;
  SaidRate rate;
};

/** Counted under the object lock of the element. */
struct CodedCounters {
  guint64 frames_in = 0;
  guint64 frames_lost = 0;
  guint64 frames_corrupted = 0;
  guint64 saturated_frames = 0;
  RectifyReport rectified; ///< of the mapping in force
};

/** Saturated frames that follow each other. */
struct Burst {
  guint64 frames = 0;
  guint64 peak = 0; ///< most saturated pixels in one of them
  GstClockTime from = GST_CLOCK_TIME_NONE;
  GstClockTime to = GST_CLOCK_TIME_NONE;
};

/** Weights take a while to make: kept as long as they are right. */
struct RectifierCache {
  Mapping mapping;
  Schedule schedule;
  RectifyOptions options;
  std::shared_ptr<const Rectifier> rectifier;
};

/** All that came, forgotten from PAUSED to READY. Sink pad's stream lock. */
struct CodedStream {
  CodedStream () { gst_segment_init (&segment, GST_FORMAT_UNDEFINED); }

  CapsPtr caps;
  guint32 caps_seqnum = 0;
  GstSegment segment;
  /** What the tags of the stream say; an error where they cannot be read. */
  std::optional<Result<StreamSetup>> tagged;
  int bits = 0;      ///< significant ones, as the frames say; 0: they do not
  bool stale = true; ///< what follows from all this has to be made again
  /** Serialised events that wait for the caps of the source pads. */
  std::vector<EventPtr> pending;
  std::optional<FrameSequence> sequence;
  GstClockTime last_pts = GST_CLOCK_TIME_NONE;
  bool was_late = false; ///< the last frame was
  Burst saturation;
  std::optional<Schedule> overruled; ///< of a tag, by the property; was said
  bool warned_assumed = false;
  bool warned_of_time = false;
  bool warned_of_mapping = false;
  std::optional<RectifierCache> rectifiers;
  Image<std::uint8_t> narrow; ///< a rectified frame, of either depth
  Image<std::uint16_t> wide;

  bool backwards () const { return segment.rate < 0; }
};

/** Times of recordings are rounded to a microsecond: what is shorter than this
 * is nothing. */
inline constexpr GstClockTime kRounding = 10 * GST_USECOND;

/** Whether what is shown from @p pts on for @p duration was asked for: a seek
 * may begin or end within a coded frame. */
inline bool
is_within (const GstSegment &segment, GstClockTime pts, GstClockTime duration)
{
  guint64 from, to;
  return gst_segment_clip (
             &segment, GST_FORMAT_TIME, pts, pts + duration, &from, &to) &&
         to - from > std::min (kRounding, duration / 2);
}

/** Shows on the bus why the coded frames cannot be used. */
void refuse (GstElement *element, const std::string &why);

/** Keeps @p text, a preset or a file, and what is read from it, with a log
 * where it cannot be read. Takes the object lock. */
void set_schedule (
    GstElement *element, CodedSettings &settings, const std::string &text);
/** The same of @p path, the file of a mapping. */
void set_mapping (
    GstElement *element, CodedSettings &settings, const std::string &path);
/** Reads the files of @p settings again: they may have changed since, and what
 * cannot be read should be known before anything runs. False, with an error on
 * the bus, where that is so. Takes the object lock. */
bool read_again (GstElement *element, CodedSettings &settings);

/** A schedule, and whether somebody said so. */
struct FoundSchedule {
  Schedule schedule;
  bool assumed = false;
};
/** The property wins over the stream's tag, which wins over the default, of
 * which is warned once. None, with an error on the bus, where what was said
 * cannot be read. */
std::optional<FoundSchedule> find_schedule (
    GstElement *element, CodedStream &stream, const CodedSettings &settings);
/** What binds caps before frames come: @p settings, else what is @p in_force;
 * null where any may come. A schedule that was only @p assumed binds nobody:
 * the tag may still come. */
ScheduleRef binding_schedule (
    const CodedSettings &settings, const ScheduleRef &in_force, bool assumed);

/** Coded frames that can be worked on. */
struct CodedFormat {
  CapsPtr caps; ///< with a frame rate in any case
  GstVideoInfo info;
};
/** None, with an error on the bus, where there is no rate or interlacing. */
std::optional<CodedFormat> find_format (GstElement *element,
    const CodedStream &stream, const CodedSettings &settings);

/** The caps of @p format, for frames of @p size pixels. */
CapsPtr resized_caps (const CodedFormat &format, Extent size);

/** Takes the significant bits from the meta of @p next, where it has one. */
void take_bits (CodedStream &stream, GstBuffer *next);
/** Frames are numbered anew, from where they were, when the rate changes. */
void count_at_rate (
    CodedStream &stream, FrameRate rate, std::optional<FrameRate> before);

/** Sets @p rectifier for frames of @p camera pixels, null where they are taken
 * as they are: the property wins over the stream's tag. Returns false, with an
 * error on the bus, when the mapping that was asked for cannot be used. */
bool find_rectifier (GstElement *element, CodedStream &stream,
    const CodedSettings &settings, const Schedule &schedule, Extent camera,
    const RectifyOptions &options, std::shared_ptr<const Rectifier> &rectifier);
/** Says and counts what @p rectifier does to the mirrors; null: nothing. */
void say_mapping (
    GstElement *element, CodedCounters &counters, const Rectifier *rectifier);
/** @p coded, one pixel a mirror, of @p bits significant bits; valid until the
 * next call. */
ImageView<const std::uint8_t> rectify (CodedStream &stream,
    const Rectifier &rectifier, ImageView<const std::uint8_t> coded, int bits);
ImageView<const std::uint16_t> rectify (CodedStream &stream,
    const Rectifier &rectifier, ImageView<const std::uint16_t> coded, int bits);

/** The CAPS query's answer @p own, as its filter wants it; takes @p own. */
void answer_caps (GstQuery *query, GstCaps *own);
/** A DURATION or POSITION in frames becomes one in frames that are @p times as
 * many. */
void scale_frames (GstQuery *query, int times);

/** What an element does about the events of coded frames. */
class CodedEvents
{
public:
  CodedEvents (GstElement *element, CodedStream &stream)
      : element_ (element), stream_ (stream)
  {
  }
  virtual ~CodedEvents () = default;

  /** Takes an event of the sink pad.
   *
   * Source pads get their caps with the first frame, because the schedule may
   * stand in a tag, and tags follow the caps. Until then events wait. */
  gboolean handle (EventPtr event);
  /** Forwards the events that waited for the caps; forgets them where no caps
   * came. */
  void settle ();

protected:
  virtual gboolean forward (EventPtr event) = 0;
  /** Whether source pads have their caps. */
  virtual bool has_plan () const = 0;
  /** Gives source pads their caps; false, with an error posted, where there can
   * be none. */
  virtual bool negotiate () = 0;
  /** Frames that are still held go out: an event comes after them. */
  virtual void drain () {}
  /** What comes next is a new beginning. */
  virtual void break_time () = 0;
  /** After FLUSH_STOP went downstream. */
  virtual void flushed () {}
  /** Before EOS and FLUSH_STOP go downstream. */
  virtual void end () {}
  virtual void gap () {}

private:
  gboolean forward_in_turn (EventPtr event);
  gboolean on_stream_start (EventPtr event);
  gboolean on_caps (const EventPtr &event);
  gboolean on_segment (EventPtr event);
  gboolean on_tag (EventPtr event);
  gboolean on_gap (EventPtr event);
  gboolean on_eos (EventPtr event);
  gboolean on_flush_stop (EventPtr event);

  GstElement *element_;
  CodedStream &stream_;
};

/** GST_FLOW_OK where @p frame stands in time; else an error is on the bus. */
GstFlowReturn check_stamp (
    GstElement *element, const CodedStream &stream, GstBuffer *frame);
/** Decoders cut from the first frame of a segment what lies before it, in time
 * only: its PTS is then that of the segment, its DURATION what is left of
 * @p period. @p frame with the times that it had; null where nothing but
 * rounding is left of it, and, with a warning, where it seems to be cut at both
 * ends, so that its start cannot be known. @p sinkpad that it came from. */
BufferPtr uncut (GstPad *sinkpad, const CodedStream &stream, BufferPtr frame,
    GstClockTime period);
/** A frame that came in. */
struct Admitted {
  /** The meta that came with it, else by our own count. */
  FrameMeta meta;
  /** It comes right after the frame before, in time and by its flags. */
  bool follows;
};
/** Counts @p frame and compares its time with that of the one before; counts
 * and says what is lost or corrupted, warns of times that cannot be.
 * @p period of the coded frames. */
Admitted admit (GstElement *element, CodedStream &stream,
    CodedCounters &counters, GstBuffer *frame, GstClockTime period);

/** Counts @p frame if @p meta says that it is saturated; says when a stretch of
 * such frames begins, and when there were none for a second. */
void note_saturation (GstElement *element, CodedStream &stream,
    CodedCounters &counters, GstClockTime pts, const FrameMeta &meta);
/** Says that a stretch of saturated frames is over, if there is one. */
void end_saturation (GstElement *element, CodedStream &stream);

} // namespace cexp::gst

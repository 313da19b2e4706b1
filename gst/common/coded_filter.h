/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* GstCodedFilter: the base class of elements that consume coded frames. */
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <gst/base/gstflowcombiner.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include "base/pixels.h"
#include "base/result.h"
#include "caps.h"
#include "coded_pad.h"
#include "element.h"
#include "excerpt.h"
#include "messages.h"
#include "meta.h"
#include "named.h"
#include "properties.h"
#include "raii.h"
#include "record/provenance.h"
#include "rectify/rectifier.h"
#include "schedule/schedule.h"
#include "setup/stream_setup.h"
#include "sync/frame_sequence.h"

namespace codedexposure::gst
{

using ScheduleRef = std::shared_ptr<const Schedule>;

/** Properties of every filter of coded frames. */
struct CodedSettings {
  Named<Schedule> schedule;
  Named<Mapping> mapping;
  Named<BenchProfile> bench;
  int bits = 0;                  ///< significant bits; 0: as the frames say
  bool require_schedule = false; ///< never assume the default
  FrameRate rate{0, 1};          ///< used if caps have none; 0/1: none
};

struct CodedCounters {
  guint64 frames_in = 0;
  guint64 frames_lost = 0;
  guint64 frames_corrupted = 0;
  guint64 frames_not_coded = 0; ///< show a pattern, or a switch to or from one
  guint64 saturated_frames = 0;
  guint64 pictures_out = 0;
  guint64 pictures_dropped = 0;
  MirrorsSeen mirrors; ///< of the mapping in force
};

/** Names in the stats of an element. */
struct StatsNames {
  const char *structure = nullptr;
  const char *out = nullptr;     ///< for pictures_out
  const char *dropped = nullptr; ///< for pictures_dropped; null: never dropped
};

/** How coded frames are decoded: caps, schedule and mapping. */
struct CodedFormat {
  CapsPtr caps; ///< of the coded frames, always with a frame rate
  GstVideoInfo info;
  FrameRate rate;
  Schedule schedule;
  bool assumed; ///< the schedule is the default
  SlotPlan slots;
  std::shared_ptr<const Rectifier> rectifier; ///< null: no mapping
  Extent size; ///< of the frames after the rectifier

  bool wide () const
  {
    return GST_VIDEO_INFO_FORMAT (&info) == GST_VIDEO_FORMAT_GRAY16_LE;
  }
  GstClockTime period () const { return GstClockTime (rate.period ()); }
  /** The caps for frames of another size. */
  CapsPtr resized (Extent other) const;
};

/** The coded frame before another, whose caps may differ. */
struct FrameBefore {
  GstClockTime pts = GST_CLOCK_TIME_NONE; ///< none: not known
  FrameRate rate = {};
};

/** A coded frame that was admitted. */
struct CodedFrame {
  BufferPtr buffer;
  /** Its meta; without one, its number by our own count. */
  FrameMeta meta;
  /** It directly follows the frame before, by its time and flags. */
  bool follows;
  /** In the part that a seek asked for. */
  Place place = Place::inside;
  FrameBefore before = {};

  GstClockTime pts () const { return GST_BUFFER_PTS (buffer.get ()); }
  /** PTS of its picture @p k of @p n. */
  GstClockTime pts_of (int k, int n, FrameRate rate) const;
};

/** A picture made from a coded frame. */
struct Picture {
  const GstVideoInfo &info;
  int index;
  GstClockTime pts;
  /** When its light was collected. */
  GstClockTime exposure_start, exposure_duration;
  bool of_region = false; ///< its coordinates are not those of the coded frame
  bool has_all_bits = false; ///< of its format, whatever the coded frame has
};

/** A frame of either depth, whose memory is used again. */
using Scratch = std::tuple<Image<std::uint8_t>, Image<std::uint16_t>>;
template <typename Pixel>
Image<Pixel> &
image_in (Scratch &scratch, Extent size)
{
  auto &image = std::get<Image<Pixel>> (scratch);
  if (image.width () != size.width || image.height () != size.height)
    image = Image<Pixel> (size.width, size.height);
  return image;
}

/** What @p seen shows by @p rectifier, in @p to. @p bits: significant ones; 0:
 * all. @p errors, if it is not null, and @p workers: see Rectifier::run (). */
template <typename Pixel>
Result<ImageView<const Pixel>>
rectify (const Rectifier &rectifier, ImageView<const Pixel> seen, int bits,
    Scratch &to, Image<float> *errors, Workers *workers)
{
  const auto [width, height] = rectifier.mirrors ();
  auto &mirrors = image_in<Pixel> (to, {width, height});
  std::optional<ImageView<float>> wanted;
  if (errors) {
    *errors = Image<float> (width, height);
    wanted = errors->view ();
  }
  if (const auto done = rectifier.run (seen, mirrors.view (),
          bits > 0 ? largest_pixel (bits) : 0, wanted, workers);
      !done)
    return done.error ();
  return ImageView<const Pixel> (mirrors.view ());
}

/**
 * The implementation of a GstCodedFilter; a subclass makes pictures from
 * frames.
 *
 * The sink pad's stream lock protects what frames and serialised events change;
 * the element's object lock protects what other threads read. The object lock
 * is never held while pushing, querying or posting. Order of locks: stream
 * lock, object lock of the element, object locks of pads.
 *
 * Callbacks are noexcept: lib/ returns errors as values, and lack of memory
 * ends the process, as in GLib.
 */
class CodedFilter
{
public:
  /** Follows the method of pictures in the provenance of their uncertainty. */
  static constexpr const char *kUncertaintyMethod = ", uncertainty";

  CodedFilter (GstElement *element, const StatsNames &names);
  virtual ~CodedFilter () = default;
  CodedFilter (const CodedFilter &) = delete;
  CodedFilter &operator= (const CodedFilter &) = delete;

  GstFlowReturn chain (BufferPtr frame);
  gboolean sink_event (EventPtr event);
  gboolean src_event (GstCodedPad *pad, GstEvent *event);
  gboolean sink_query (GstQuery *query);
  gboolean src_query (GstCodedPad *pad, GstQuery *query);

  /** After a property of @p object was set. Object lock. */
  static void settings_changed (GObject *object, const GParamSpec *);

protected:
  /* For subclasses to implement. Called on the streaming thread, unless noted.
   */

  /** Handles a frame, which has format (). */
  virtual GstFlowReturn process (CodedFrame frame) = 0;
  /** The frames on which the pictures of another depend. Streaming thread, also
   * before there is a plan. */
  virtual Reach reach () const { return {.history = 1}; }
  /** Learns from a frame outside of the part that a seek asked for: it has no
   * pictures. */
  virtual GstFlowReturn learn (CodedFrame) { return GST_FLOW_OK; }
  /** Prepares for frames of @p format, and adds the caps of pictures to @p
   * caps, which has those of coded frames. On failure posts an error, keeps the
   * plan in force and returns false. */
  virtual bool plan (const CodedFormat &format, PadCaps &caps) = 0;
  /** Called after the source pads got the caps of the plan. */
  virtual void planned (bool /* schedule_changed */) {}
  /** Pushes all frames that are held. */
  virtual GstFlowReturn drain () { return GST_FLOW_OK; }
  /** Forgets past frames: the next one does not follow them. */
  virtual void break_history () {}
  /** Whether there may be a numbered pad; if not, it says so. Any thread. */
  virtual bool allows_pad (PadKind, int /* index */) const { return true; }
  /** What @p gap, in place of a coded frame, is on @p pad. */
  virtual EventPtr gap_for (const GstCodedPad *, GstEvent *gap) const
  {
    return EventPtr (gst_event_ref (gap));
  }
  /** After FLUSH_STOP went downstream. */
  virtual void flushed () {}
  /** A run starts: its counters are 0. Object lock. */
  virtual void reset_counters () {}
  /** Puts the subclass's settings into force. Object lock. */
  virtual void take_settings () {}
  /** Forgets the stream; from PAUSED to READY. */
  virtual void forget () = 0;

  /** Cancels long computations: their results are no longer needed. Any thread.
   */
  virtual void cancel () {}
  /** Allows computations again. Any thread. */
  virtual void resume () {}
  /** How the caps of @p pad follow from those of coded frames. */
  virtual CapsScale scale_for (
      const Schedule &schedule, const GstCodedPad *pad) const = 0;
  /** Pictures of @p pad, which has pictures, for each coded frame. Object lock.
   */
  virtual int pictures_a_frame (const GstCodedPad *pad) const = 0;
  virtual RectifyOptions rectify_options (const Schedule &) const { return {}; }
  /** At most; 0: one for each processor. */
  virtual int threads () const { return 0; }
  /** How pictures are made, for their provenance: "select". */
  virtual std::string method_name () const = 0;

  /** A snapshot of what caps queries depend on. */
  struct CapsContext {
    ScheduleRef schedule; ///< null: not known yet
    FrameRate rate;
    bool mapped; ///< frames and pictures can be of any size
  };
  /** Converts @p caps of @p pad, which has pictures, to those of coded frames,
   * or back. Any thread. */
  virtual CapsPtr convert_caps (const CapsContext &context,
      const GstCodedPad *pad, GstCaps *caps, bool to_coded) const;

  /* For subclasses to use. */

  /** The source pads. Replaced, never changed: the streaming thread uses a map
   * while the application requests and releases pads. Any thread. */
  std::shared_ptr<const PadMap> pads () const;
  using PadVisitor = std::function<void (GstCodedPad *)>;
  void each_pad (const PadVisitor &visit) const;
  /** The caps in force of @p pad; null: none yet. Any thread. */
  CapsPtr caps_for (const GstCodedPad *pad) const;
  GstElement *element () const { return element_; }
  GstPad *sinkpad () const { return sinkpad_; }
  bool has_format () const { return stream_.format.has_value (); }
  const CodedFormat &format () const { return *stream_.format; }
  /** That downstream has. */
  const GstSegment &segment () const { return stream_.segment; }
  bool backwards () const { return stream_.segment.rate < 0; }
  /** Of the bench; null: not known. */
  const BenchProfile *bench () const
  {
    return stream_.bench ? &*stream_.bench : nullptr;
  }
  /** As the tags say, which may say nothing. */
  const StreamSetup &tagged () const
  {
    static const StreamSetup nothing;
    return stream_.tagged && *stream_.tagged ? stream_.tagged->value ()
                                             : nothing;
  }
  /** From the property, else from the frames, else from their tag, else from
   * the bench profile; 0: all bits of the format. */
  int significant_bits () const;
  /** Returns false. */
  bool post_error (const std::string &why) const;
  /** Posts that a frame could not be decoded, and returns GST_FLOW_ERROR, or
   * FLUSHING, without a message, if that was cancelled. */
  GstFlowReturn post_decode_error (const Error &error) const;
  void notify (const char *property) const;

  /** Maps @p frame for reading; posts an error if it is too short. */
  MappedFrame map_coded (GstBuffer *frame) const;
  /** The light of a coded frame, which is its pixels less the black level; with
   * a mapping, one pixel a mirror. Valid until the next call.
   * @p errors  set with a mapping: see Rectifier::run (). */
  template <typename Pixel>
  Result<ImageView<const Pixel>> light_of (
      ImageView<const Pixel> coded, Image<float> *errors = nullptr);
  /** Share the rows of frames that are rectified; made when first needed. */
  Workers &rectify_workers ();
  /** Whether the segment contains the time from @p pts for @p duration. */
  bool is_within (GstClockTime pts, GstClockTime duration) const;
  /** Posts a message when a sequence of saturated frames begins, and when there
   * were none for a second. */
  void note_saturation (const CodedFrame &frame);
  /** Pushes @p outbuf, which is writable, and counts it. */
  GstFlowReturn push (
      GstCodedPad *pad, BufferPtr outbuf, GstClockTime duration);
  /** Combines @p flow of @p pad with the flows of the others; NOT_LINKED: for a
   * pad on which nothing is pushed. OK if the pad was released. */
  GstFlowReturn combine_flow (GstCodedPad *pad, GstFlowReturn flow);
  /** The others go on when one pad is NOT_LINKED or EOS. */
  static bool is_fatal (GstFlowReturn flow)
  {
    return flow == GST_FLOW_FLUSHING || flow <= GST_FLOW_NOT_NEGOTIATED;
  }
  /** Gives @p outbuf flags, metas and time of a picture made from @p coded. */
  void describe (GstBuffer *outbuf, GstBuffer *coded, FrameMeta meta,
      const Picture &picture) const;
  /** Acquires a buffer from the pool of @p pad, for the @p first picture of a
   * coded frame or another, and maps it for writing. Posts an error on failure,
   * except while flushing. */
  GstFlowReturn acquire_picture (GstCodedPad *pad, const GstVideoInfo &info,
      bool first, BufferPtr &buffer, MappedFrame &mapped) const;

  /** What other threads read; reset from PAUSED to READY. */
  struct InForce {
    ScheduleRef schedule; ///< in force; null before the first frame
    bool assumed = false; ///< the schedule is the default
    /** Of the pictures; null before the first frame. */
    std::shared_ptr<const Provenance> provenance;
    bool rectifies = false;  ///< a mapping is in force
    GstClockTime period = 0; ///< of the coded frames; 0: not known yet
    guint32 last_seek = GST_SEQNUM_INVALID; ///< that went upstream
    GstClockTime stop_asked = GST_CLOCK_TIME_NONE;
    GstClockTime latency = 0; ///< added by frames that are held
  };
  /** And what they set. */
  struct Shared : InForce {
    StatsNames names;
    CodedSettings settings;
    bool settings_changed = true;
    CodedCounters counters;

    StructurePtr stats () const;
  };
  Shared shared_; ///< object lock

private:
  friend GType coded_filter_type ();

  /** Reused while its inputs are the same: weights take long to compute. */
  struct RectifierCache {
    Mapping mapping;
    Schedule schedule;
    RectifyOptions options;
    std::shared_ptr<const Rectifier> rectifier;
  };
  /** Reset from PAUSED to READY. */
  struct Stream {
    Stream () { end_segment (); }

    void end_segment ()
    {
      excerpt.reset ();
      gst_segment_init (&segment, GST_FORMAT_UNDEFINED);
      upstream = segment;
    }

    std::string id;
    CapsPtr caps;
    guint32 caps_seqnum = 0;
    GstSegment segment;
    GstSegment upstream; ///< its segment
    guint32 segment_seqnum = GST_SEQNUM_INVALID;
    std::optional<Excerpt> excerpt; ///< that a seek asked for
    /** From the tags; an error if they cannot be read. */
    std::optional<Result<StreamSetup>> tagged;
    /** Why the frames are refused, if they were decoded before. */
    std::optional<std::string> not_coded;
    int bits = 0;        ///< significant bits by the metas; 0: unknown
    int tagged_bits = 0; ///< by the tags
    bool stale = true;   ///< the plan must be made again
    bool provenance_due = false;
    CodedSettings settings;
    std::optional<CodedFormat> format; ///< in force
    std::optional<BenchProfile> bench;
    /** Serialised events that wait for the caps of the source pads. */
    std::vector<EventPtr> pending;
    std::optional<FrameSequence> sequence;
    GstClockTime last_pts = GST_CLOCK_TIME_NONE;
    FrameBefore before;       ///< with last_pts, if time goes on
    bool was_late = false;    ///< the last frame was
    bool is_recorded = false; ///< kRecordedEvent came
    /** PTS of a recorded frame, from its exposure on; all have the same. */
    std::optional<GstClockTimeDiff> moved;
    /** Until when upstream has said that frames are missing. */
    GstClockTime missing_until = 0;
    std::string pattern; ///< that was said of frames that are not decoded
    /** What is said at the end of a sequence of saturated frames. */
    std::optional<Saturated> saturation;
    std::optional<Schedule> overruled; ///< tagged, and reported as overruled
    bool warned_assumed = false;
    bool warned_of_time = false;
    bool warned_of_edit = false;
    bool warned_of_mapping = false;
    bool warned_of_bench = false;
    std::optional<RectifierCache> rectifiers;
    Scratch light; ///< a frame without its black level
    Scratch rectified;
    std::unique_ptr<Workers> workers; ///< see rectify_workers ()
  };

  /* Pads. */
  GstCodedPad *add_pad (
      const char *templ, PadKind kind, const std::string &name, int index);
  void insert_pad (PadRef pad);
  PadRef take_pad (GstPad *pad);
  GstPad *request_pad (GstPadTemplate *templ, const gchar *name);
  void release_pad (GstPad *pad);
  static gboolean replay_sticky (GstPad *, GstEvent **event, gpointer replay);
  /** @p event as @p pad is to have it: pictures say how they were made, where
   * coded frames have their setup. Transfer: full, of both. */
  static GstEvent *event_for (
      const GstCodedPad *pad, GstEvent *event, const Provenance *provenance);
  /** @p made for the pictures of @p pad. */
  static Provenance provenance_for (const GstCodedPad *pad, Provenance made);
  /** Pushes @p event on the source pads. */
  gboolean forward (EventPtr event);
  GstFlowReturn push_coded (const CodedFrame &frame);
  /** A flush comes from another thread than frames, and is forwarded, too. */
  std::shared_ptr<const Provenance> provenance () const;

  static PropertyTable<Shared> properties ();
  static Shared &shared_of (GObject *object);
  bool read_settings ();
  void begin ();
  void forget_stream ();
  static void set_up_class (gpointer klass);
  /** Makes a new plan if it is stale, and sends caps and waiting events. Posts
   * an error on failure. @p next: the frame that comes next; null: none. */
  GstFlowReturn negotiate (GstBuffer *next = nullptr);
  void push_caps (GstCodedPad *pad);
  std::optional<CodedFormat> find_format ();
  bool find_schedule (CodedFormat &format);
  bool find_bench (CodedFormat &format);
  Result<void> check_bench (const GstVideoInfo &info) const;
  /** By the metas of the frames, else by their tag. */
  int said_bits () const
  {
    return stream_.bits > 0 ? stream_.bits : stream_.tagged_bits;
  }
  bool find_mapping (Extent camera, std::optional<Mapping> &mapping);
  bool find_rectifier (CodedFormat &format);
  bool match_camera (CodedFormat &format) const;
  void adopt (CodedFormat format, GstBuffer *next);
  void report_change (const Schedule &before, GstBuffer *next);
  void set_provenance (GstBuffer *next);
  void push_provenance ();
  void report_overruled (const Schedule &asked);
  void report_mirrors ();

  GstFlowReturn check_time_stamp (GstBuffer *frame) const;
  /** After the part that a seek asked for. */
  bool is_past (GstBuffer *frame) const;
  BufferPtr restore_clipped_frame (BufferPtr frame);
  CodedFrame admit (BufferPtr frame);
  const char *edit_of (GstBuffer *frame, const std::optional<FrameMeta> &meta);
  void flag_edited (BufferPtr &frame, const std::optional<FrameMeta> &meta);
  void include (const CodedFrame &frame);
  GstFlowReturn break_off ();
  GstFlowReturn skip (const CodedFrame &frame);
  void note_missing (GstEvent *gap);
  void report_loss (GstClockTime pts, guint64 lost, guint64 told);
  void warn_of_wrong_time (GstClockTime pts);
  void end_saturation ();
  void count (guint64 CodedCounters::*counter, guint64 by = 1);

  void settle_events ();
  void settle_at_end ();
  gboolean forward_in_turn (EventPtr event);
  gboolean on_stream_start (EventPtr event);
  gboolean on_caps (const EventPtr &event);
  gboolean on_segment (EventPtr event);
  gboolean on_tag (EventPtr event);
  gboolean on_gap (EventPtr event);
  gboolean on_segment_done (EventPtr event);
  gboolean on_eos (EventPtr event);
  gboolean on_flush_stop (EventPtr event);
  void break_time ();
  void begin_excerpt (const SeekRequest &request);
  EventPtr segment_event () const;
  bool awaits_excerpt () const
  {
    return stream_.excerpt && !stream_.excerpt->begun;
  }
  gboolean seek (EventPtr event);
  GstClockTime period_for_seek () const;

  CapsContext caps_context () const;
  CapsPtr caps_between (const CapsContext &context, const GstCodedPad *pad,
      GstCaps *caps, bool to_coded) const;
  CapsPtr sink_caps () const;
  CapsPtr src_caps (GstCodedPad *pad) const;
  gboolean answer_allocation (GstQuery *query) const;
  void scale_frames (GstCodedPad *pad, GstQuery *query) const;

  GstElement *element_;
  GstPad *sinkpad_;
  Stream stream_;

  /* Object lock. */
  std::shared_ptr<const PadMap> pads_ = std::make_shared<PadMap> ();
  PadCaps caps_;
  bool ended_ = false; ///< EOS was forwarded
  std::unique_ptr<GstFlowCombiner, FreeWith<gst_flow_combiner_free>> combiner_{
      gst_flow_combiner_new ()};
};

/** Abstract; an instance of a derived type is its own CodedFilter. */
struct GstCodedFilter : Instance<GstElement, CodedFilter *> {
};
GType coded_filter_type ();
/** The implementation of @p element. */
inline CodedFilter &
filter_of (gpointer element)
{
  return *state_in<GstCodedFilter> (element);
}

} // namespace codedexposure::gst

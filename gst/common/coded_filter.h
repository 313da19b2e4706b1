/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* GstCodedFilter: the base class of elements that consume coded frames. */
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "base/result.h"
#include "caps.h"
#include "coded_pad.h"
#include "mapping/stream_setup.h"
#include "messages.h"
#include "meta.h"
#include "named.h"
#include "properties.h"
#include "raii.h"
#include "rectify/rectifier.h"
#include "schedule/schedule.h"
#include "sync/frame_sequence.h"

G_BEGIN_DECLS

#define GST_TYPE_CODED_FILTER (gst_coded_filter_get_type ())
G_DECLARE_DERIVABLE_TYPE (
    GstCodedFilter, gst_coded_filter, GST, CODED_FILTER, GstElement)

struct _GstCodedFilterClass {
  GstElementClass parent_class;
};

G_END_DECLS

namespace codedexposure::gst
{

using ScheduleRef = std::shared_ptr<const Schedule>;

/** What the user says of coded frames. */
struct CodedSettings {
  Named<Schedule> schedule;
  Named<Mapping> mapping;
  int bits = 0;         ///< significant ones; 0: as the frames say
  FrameRate rate{0, 1}; ///< where caps have none; 0/1: none
};

struct CodedCounters {
  guint64 frames_in = 0;
  guint64 frames_lost = 0;
  guint64 frames_corrupted = 0;
  guint64 saturated_frames = 0;
  guint64 pictures_out = 0;
  guint64 pictures_dropped = 0;
  MirrorsSeen mirrors; ///< of the mapping in force
};

/** Names in the stats of an element. */
struct StatsNames {
  const char *structure = nullptr;
  const char *out = nullptr;     ///< for pictures_out
  const char *dropped = nullptr; ///< for pictures_dropped; null: none ever is
};

/** What plans are made of: the caps, the schedule and the mapping together. */
struct CodedFormat {
  CapsPtr caps; ///< of the coded frames, with a frame rate in any case
  GstVideoInfo info;
  FrameRate rate;
  Schedule schedule;
  bool assumed; ///< the schedule: nobody said which
  SlotPlan slots;
  std::shared_ptr<const Rectifier> rectifier; ///< null: no mapping
  Extent size; ///< of the frames that are decoded, after the rectifier

  bool wide () const
  {
    return GST_VIDEO_INFO_FORMAT (&info) == GST_VIDEO_FORMAT_GRAY16_LE;
  }
  GstClockTime period () const { return GstClockTime (rate.period ()); }
  /** The caps for frames of another size. */
  CapsPtr resized (Extent other) const;
};

/** A coded frame that was admitted. */
struct CodedFrame {
  BufferPtr buffer;
  /** The meta that came with it, else by our own count. */
  FrameMeta meta;
  /** It comes right after the frame before, in time and by its flags. */
  bool follows;

  GstClockTime pts () const { return GST_BUFFER_PTS (buffer.get ()); }
  bool has_flags (guint flags) const
  {
    return GST_BUFFER_FLAGS (buffer.get ()) & flags;
  }
};

/** One picture that is made of a coded frame. */
struct Picture {
  const GstVideoInfo &info;
  int index;
  GstClockTime pts;
  /** Start and length of its light. */
  GstClockTime exposure_start, exposure_duration;
  bool of_region = false; ///< its places are not those of the coded frame
};

/**
 * What a GstCodedFilter does; a subclass decides what becomes of each frame.
 *
 * Everything that frames and serialised events change is under the stream lock
 * of the sink pad; what other threads read, under the object lock of the
 * element, which is never held while pushing, querying or posting. The stream
 * lock is taken before it, the object locks of pads after it.
 *
 * What GStreamer calls is noexcept: lib/ returns its errors, and a lack of
 * memory ends the process, as in GLib.
 */
class CodedFilter
{
public:
  CodedFilter (GstCodedFilter *element, const StatsNames &names);
  virtual ~CodedFilter () = default;
  CodedFilter (const CodedFilter &) = delete;
  CodedFilter &operator= (const CodedFilter &) = delete;

  GstFlowReturn chain (BufferPtr frame);
  gboolean sink_event (EventPtr event);
  gboolean src_event (GstCodedPad *pad, GstEvent *event);
  gboolean sink_query (GstQuery *query);
  gboolean src_query (GstCodedPad *pad, GstQuery *query);

  static void set_up_class (gpointer klass);
  /** After a property of @p object was set. Object lock. */
  static void settings_changed (GObject *object, const GParamSpec *);

protected:
  /* What a subclass does. Unless said otherwise, on the streaming thread. */

  /** Takes a frame, whose format () is in force. */
  virtual GstFlowReturn process (CodedFrame frame) = 0;
  /** Prepares for frames of @p format; false, with an error posted and what
   * was before in force, where that cannot be. */
  virtual bool plan (const CodedFormat &format) = 0;
  /** After source pads have the caps of the plan. */
  virtual void planned (bool /* schedule_changed */) {}
  /** Pushes the frames that are held: what follows comes after them. */
  virtual GstFlowReturn drain () { return GST_FLOW_OK; }
  /** The next frame does not follow the last one. */
  virtual void break_history () {}
  /** Pushes @p event on the source pads. */
  virtual gboolean forward (EventPtr event) = 0;
  /** After FLUSH_STOP went downstream. */
  virtual void flushed () {}
  /** Copies own settings to where they are in force. Object lock. */
  virtual void take_settings () {}
  /** Forgets the stream; from PAUSED to READY. */
  virtual void forget () = 0;

  /** Ends work that takes long, whose result nobody waits for. Any thread. */
  virtual void cancel () {}
  /** Work is wanted again. Any thread. */
  virtual void resume () {}
  /** Calls @p visit for each source pad. Any thread. */
  using PadVisitor = std::function<void (GstCodedPad *)>;
  virtual void each_pad (const PadVisitor &visit) const = 0;
  /** The caps in force of @p pad, null before. Any thread. */
  virtual CapsPtr caps_for (const GstCodedPad *pad) const = 0;
  /** What happens to the caps of coded frames on their way to @p pad. */
  virtual CapsScale scale_for (
      const Schedule &schedule, const GstCodedPad *pad) const = 0;
  /** Pictures of @p pad for each coded frame. Object lock. */
  virtual int pictures_a_frame (const GstCodedPad *pad) const = 0;
  /** The pad on which coded frames leave in their own memory; null: none. */
  virtual ObjectPtr<GstPad> coded_pad () const { return nullptr; }
  virtual RectifyOptions rectify_options () const { return {}; }

  /** What answers about caps depend on, at one moment. */
  struct CapsContext {
    ScheduleRef schedule; ///< null: any may come
    FrameRate rate;
    bool mapped; ///< frames and pictures can be of any size
  };
  /** @p caps of @p pad as those of coded frames, or the other way. Any thread.
   */
  virtual CapsPtr convert_caps (const CapsContext &context,
      const GstCodedPad *pad, GstCaps *caps, bool to_coded) const;

  /* What a subclass uses. */

  /** A source pad with the functions that all of them have. */
  ObjectPtr<GstCodedPad> new_source_pad (const char *templ,
      const std::string &name, PadKind kind, int index = -1) const;
  GstElement *element () const { return element_; }
  GstPad *sinkpad () const { return sinkpad_; }
  bool has_format () const { return stream_.format.has_value (); }
  const CodedFormat &format () const { return *stream_.format; }
  const GstSegment &segment () const { return stream_.segment; }
  bool backwards () const { return stream_.segment.rate < 0; }
  /** The property wins over the frames; 0: all bits of the format. */
  int significant_bits () const;
  void post_error (const std::string &why) const;
  /** Posts that a frame could not be decoded. Returns GST_FLOW_ERROR. */
  GstFlowReturn post_decode_error (const Error &error) const;
  void notify (const char *property) const;

  /** @p frame to read; not mapped, with an error posted, where it is too short.
   */
  MappedFrame map_coded (GstBuffer *frame) const;
  /** The pixels of a coded frame, one a mirror where a mapping is in force;
   * valid until the next call. */
  template <typename Pixel>
  Result<ImageView<const Pixel>> rectify (ImageView<const Pixel> coded);
  /** Whether a seek asked for what is shown from @p pts for @p duration. */
  bool is_within (GstClockTime pts, GstClockTime duration) const;
  /** Posts when a sequence of saturated frames begins, and when there was none
   * for a second. */
  void note_saturation (const CodedFrame &frame);
  /** Pushes @p outbuf, which is writable, and counts it. */
  GstFlowReturn push (
      GstCodedPad *pad, BufferPtr outbuf, GstClockTime duration);
  /** Copies what is known of the frame @p coded to @p outbuf, made of it. */
  void describe (GstBuffer *outbuf, GstBuffer *coded, FrameMeta meta,
      const Picture &picture) const;
  /** Takes a buffer of @p info from the pool of @p pad and maps it for writing;
   * where there is none, an error is posted, but not for a flush. */
  GstFlowReturn acquire_picture (GstCodedPad *pad, const GstVideoInfo &info,
      BufferPtr &buffer, MappedFrame &mapped) const;

  /** What other threads set and read. */
  struct Shared {
    StatsNames names;
    CodedSettings settings;
    bool settings_changed = true;
    CodedCounters counters;
    ScheduleRef schedule;     ///< in force; null before the first frame
    bool assumed = false;     ///< nobody said which schedule it is
    bool rectifies = false;   ///< a mapping is in force
    GstClockTime latency = 0; ///< that frames which are held add

    StructurePtr stats () const;
  };
  Shared shared_; ///< object lock

private:
  /** Saturated frames that follow each other. */
  struct Burst {
    guint64 frames = 0;
    guint64 peak = 0; ///< most saturated pixels in one of them
    GstClockTime from = GST_CLOCK_TIME_NONE;
    GstClockTime to = GST_CLOCK_TIME_NONE;
  };
  /** Kept as long as it is right, because weights take long to compute. */
  struct RectifierCache {
    Mapping mapping;
    Schedule schedule;
    RectifyOptions options;
    std::shared_ptr<const Rectifier> rectifier;
  };
  /** Everything that is forgotten from PAUSED to READY. */
  struct Stream {
    Stream () { gst_segment_init (&segment, GST_FORMAT_UNDEFINED); }

    CapsPtr caps;
    guint32 caps_seqnum = 0;
    GstSegment segment;
    /** What the tags say; an error where they cannot be read. */
    std::optional<Result<StreamSetup>> tagged;
    int bits = 0;      ///< significant ones by the metas; 0: not said
    bool stale = true; ///< the plan has to be made again
    CodedSettings settings;
    std::optional<CodedFormat> format; ///< in force
    /** Serialised events that wait for the caps of the source pads. */
    std::vector<EventPtr> pending;
    std::optional<FrameSequence> sequence;
    GstClockTime last_pts = GST_CLOCK_TIME_NONE;
    bool was_late = false; ///< the last frame was
    Burst saturation;
    std::optional<Schedule> overruled; ///< by the property, as was posted
    bool warned_assumed = false;
    bool warned_of_time = false;
    bool warned_of_mapping = false;
    std::optional<RectifierCache> rectifiers;
    Image<std::uint8_t> narrow; ///< a rectified frame, of either depth
    Image<std::uint16_t> wide;
  };

  static const PropertyTable<Shared> &properties ();
  static Shared &shared_of (GObject *object);
  bool read_settings ();
  bool before_state_change (GstStateChange transition);
  void after_state_change (GstStateChange transition);
  /** Source pads get their caps and what waited for them; posts an error and
   * returns other than OK where there can be no plan.
   * @p next  the frame that comes next, where there is one. */
  GstFlowReturn negotiate (GstBuffer *next = nullptr);
  void push_caps (GstCodedPad *pad);
  std::optional<CodedFormat> find_format ();
  bool find_schedule (CodedFormat &format);
  bool find_mapping (Extent camera, std::optional<Mapping> &mapping);
  bool find_rectifier (CodedFormat &format);
  void adopt (CodedFormat format);
  void report_overruled (const Schedule &asked);
  void report_mirrors ();

  GstFlowReturn check_time_stamp (GstBuffer *frame) const;
  BufferPtr restore_clipped_frame (BufferPtr frame) const;
  CodedFrame admit (BufferPtr frame);
  GstFlowReturn break_off ();
  void report_loss (GstClockTime pts, guint64 lost);
  void warn_of_wrong_time (GstClockTime pts);
  void end_saturation ();
  void count (guint64 CodedCounters::*counter, guint64 by = 1);

  void settle_events ();
  gboolean forward_in_turn (EventPtr event);
  gboolean on_stream_start (EventPtr event);
  gboolean on_caps (const EventPtr &event);
  gboolean on_segment (EventPtr event);
  gboolean on_tag (EventPtr event);
  gboolean on_gap (EventPtr event);
  gboolean on_eos (EventPtr event);
  gboolean on_flush_stop (EventPtr event);
  void break_time ();

  CapsContext caps_context () const;
  CapsPtr sink_caps () const;
  CapsPtr src_caps (GstCodedPad *pad) const;
  gboolean answer_allocation (GstQuery *query) const;
  void scale_frames (GstCodedPad *pad, GstQuery *query) const;

  GstElement *element_;
  GstPad *sinkpad_;
  Stream stream_;
};

/** Gives @p element its C++ part; once, when the instance is made. */
void adopt_filter (
    GstCodedFilter *element, std::unique_ptr<CodedFilter> filter);
/** The C++ part of @p element, an instance of a subclass. */
CodedFilter &filter_of (gpointer element);

} // namespace codedexposure::gst

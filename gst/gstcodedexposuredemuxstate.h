/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What codedexposure-demux knows, and what its parts call each other for. */
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <gst/base/gstflowcombiner.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include "extract/extractor.h"
#include "gstcodedexposuredemux.h"
#include "gstcodedinput.h"

GST_DEBUG_CATEGORY_EXTERN (codedexposure_demux_debug);

namespace cexp::gst::demux
{

/** What the user asked for. */
struct Settings : CodedSettings {
  ExtractOptions extract;
  bool qos = false;
};

struct Counters : CodedCounters {
  guint64 subframes_out = 0;
  guint64 subframes_dropped = 0;
};

struct PoolRelease {
  void operator() (GstBufferPool *pool) const
  {
    gst_buffer_pool_set_active (pool, FALSE);
    gst_object_unref (pool);
  }
};
using PoolPtr = std::unique_ptr<GstBufferPool, PoolRelease>;

/** Where the buffers of a pad come from. */
struct Allocation {
  PoolPtr pool;
  /** Only a pool that is used is active: starting it allocates. */
  bool active = false;
  /** The peer reads strides and offsets from the GstVideoMeta. */
  bool video_meta = false;
};

/** A source pad. */
struct Output {
  enum class Kind { kAll, kOne, kRegion, kCoded };

  Kind kind;
  int index; ///< of the subframe, for kOne, or of the region
  ObjectPtr<GstPad> pad;

  /* Sink pad's stream lock. */
  bool discont = true;
  guint64 offset = 0;
  std::optional<Allocation> allocation;

  /* Object lock of the element. */
  bool released = false;
  /** Running time before which a subframe would come too late. */
  GstClockTime earliest = GST_CLOCK_TIME_NONE;
  gdouble proportion = 1.0;
  GstClockTimeDiff jitter = 0;
};
using OutputRef = std::shared_ptr<Output>;

/** All source pads at one moment. */
struct Outputs {
  OutputRef all;
  OutputRef coded; ///< null until requested
  std::map<int, OutputRef> ones;
  std::map<int, OutputRef> regions;

  template <typename F>
  void each (F &&f) const
  {
    if (coded)
      f (coded);
    f (all);
    for (const auto &[index, output] : ones)
      f (output);
    for (const auto &[index, output] : regions)
      f (output);
  }
  /** Numbered pads of one kind. */
  std::map<int, OutputRef> &numbered (Output::Kind kind)
  {
    return kind == Output::Kind::kRegion ? regions : ones;
  }
};

/** What is pushed on each kind of pad. */
struct PadCaps {
  CapsPtr coded, all, one;
  std::vector<CapsPtr> regions;
  /** Null for a region that there is not. */
  GstCaps *of (const Output &output) const;
  explicit operator bool () const { return all != nullptr; }
};

using AnyExtractor =
    std::variant<Extractor<std::uint8_t>, Extractor<std::uint16_t>>;

/** Light that a subframe holds, counted from the start of its coded frame. */
struct Window {
  GstClockTime start, duration;
};

/** What is taken apart by one tile and one code. */
struct Part {
  int region; ///< -1: the background, or all there is
  Schedule schedule;
  Rect rect; ///< of the frame that is taken apart
  GstVideoInfo subframe;
  AnyExtractor extractor;
  Method method;
  /** Slot boundaries, n + 1 of them, counted from the frame's PTS. */
  std::vector<GstClockTime> boundaries;
  std::vector<Window> windows;

  int subframes () const { return schedule.elements (); }
  GstClockTime period () const { return boundaries.back (); }
};

/** Everything that follows from the caps, the schedule and the settings. */
struct Plan {
  Schedule schedule;
  GstVideoInfo coded;
  FrameRate rate;
  std::vector<Part> parts; ///< the background, then the regions
  /** Null: the camera stands as the schedule has it. */
  std::shared_ptr<const Rectifier> rectifier = nullptr;
  Extent extracted = {}; ///< size of the frame that is taken apart

  const Part &background () const { return parts.front (); }
  GstClockTime period () const { return background ().period (); }
};

/** All that is forgotten from PAUSED to READY. Sink pad's stream lock. */
struct Stream : CodedStream {
  Settings settings; ///< in force
  std::optional<Plan> plan;
  /** Significant bits: the property wins over the frames; 0: of the type. */
  int bits_in_force () const
  {
    return settings.extract.bits > 0 ? settings.extract.bits : bits;
  }
  std::optional<bool> live;       ///< asked for when first needed
  std::vector<std::byte> scratch; ///< subframes that no pad wants
};

struct CombinerFree {
  void operator() (GstFlowCombiner *combiner) const
  {
    gst_flow_combiner_free (combiner);
  }
};

/** Behind the GObject.
 *
 * What GStreamer calls is noexcept: lib/ returns its errors, and a lack of
 * memory ends the process, as in GLib.
 *
 * The object lock of the element is never held while
 * pushing, querying or posting; the stream lock of the sink pad is taken before
 * it, the object locks of pads after it.
 */
struct DemuxState {
  GstPad *sinkpad = nullptr;

  /* Object lock. */
  Settings settings;
  bool settings_changed = true;
  /** Replaced, never changed: the streaming thread works on one while the
   * application requests and releases pads. */
  std::shared_ptr<const Outputs> outputs = std::make_shared<Outputs> ();
  std::unique_ptr<GstFlowCombiner, CombinerFree> combiner{
      gst_flow_combiner_new ()};
  Counters counters;
  PadCaps caps;
  ScheduleRef in_force;   ///< null before the first frame
  bool assumed = false;   ///< in_force came from nowhere
  bool rectifies = false; ///< a mapping is in force
  Method method = Method::kAuto;
  bool ended = false; ///< EOS was forwarded

  /* Sink pad's stream lock. */
  Stream stream;
};

/* Properties. */
void install_properties (GObjectClass *klass);

DemuxState &state (GstCodedExposureDemux *self);
std::shared_ptr<const Outputs> outputs (GstCodedExposureDemux *self);
/** Notifies of a property that the streaming thread changed. */
void notify (GstCodedExposureDemux *self, const char *property);

/* Pads. */
OutputRef add_output (GstCodedExposureDemux *self, GstPadTemplate *templ,
    Output::Kind kind, int index);
/** How many pads there can be of a kind that has numbers; @p schedule may be
 * null, if none is known. */
int numbered_pads (Output::Kind kind, const Schedule *schedule);
/** The same for people. */
std::string pads_text (Output::Kind kind, const Schedule *schedule);
GstPad *request_pad (GstElement *element, GstPadTemplate *templ,
    const gchar *name, const GstCaps *caps) noexcept;
void release_pad (GstElement *element, GstPad *pad) noexcept;
/** Whether a buffer pushed there goes anywhere. */
bool is_wanted (const Output &output);
/** Pushes @p event on every source pad, in the form that suits each. */
gboolean forward (GstCodedExposureDemux *self, EventPtr event);
/** The negotiated caps of @p output. */
CapsPtr caps_for (GstCodedExposureDemux *self, const Output &output);
void push_caps (GstCodedExposureDemux *self, const Output &output);
/** The flow of all pads together after @p output returned @p flow to a buffer,
 * which is counted; NOT_LINKED where there was none to push. */
GstFlowReturn combine_flow (
    GstCodedExposureDemux *self, const Output &output, GstFlowReturn flow);
void forget_flow (GstCodedExposureDemux *self);

/* Events and queries. */
gboolean sink_event (GstPad *pad, GstObject *parent, GstEvent *event) noexcept;
gboolean src_event (GstPad *pad, GstObject *parent, GstEvent *event) noexcept;
gboolean sink_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept;
gboolean src_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept;

/* Negotiation. */
/** Makes the plan and tells the source pads, where that is due. Posts an error
 * and returns other than OK when there can be no plan.
 * @p next  the frame that comes next, where there is one. */
GstFlowReturn negotiate (
    GstCodedExposureDemux *self, GstBuffer *next = nullptr);
/** Whether the plan has a subframe or a region for every pad of @p list; posts
 * an error where it has not. */
bool check_pads (GstCodedExposureDemux *self, const Outputs &list);
/** Forwards the events that waited for the caps. */
void settle_events (GstCodedExposureDemux *self);
/** Answers for the CAPS query; Transfer: full. */
GstCaps *sink_caps (GstCodedExposureDemux *self);
GstCaps *src_caps (GstCodedExposureDemux *self, GstPad *pad);

/* Buffers. */
/** Asks the peer of @p output for its pool, where that is due. @p at_once
 * buffers of it will be out at the same time. */
void prepare_allocation (
    GstCodedExposureDemux *self, Output &output, guint at_once);
/** A subframe's buffer from the pool of @p output. */
GstFlowReturn acquire (Output &output, BufferPtr &outbuf);
gboolean answer_allocation (GstCodedExposureDemux *self, GstQuery *query);

/* Frames. */
GstFlowReturn chain (GstPad *pad, GstObject *parent, GstBuffer *inbuf) noexcept;

} // namespace cexp::gst::demux

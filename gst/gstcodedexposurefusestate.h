/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What codedexposure-fuse knows, and what its parts call each other for. */
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "fuse/fuser.h"
#include "gstcodedexposurefuse.h"
#include "gstcodedinput.h"

GST_DEBUG_CATEGORY_EXTERN (codedexposure_fuse_debug);

namespace cexp::gst::fuse
{

/** What the user asked for. */
struct Settings : CodedSettings {
  FuseOptions options;
};

struct Counters : CodedCounters {
  guint64 frames_out = 0;
};

struct PoolRelease {
  void operator() (GstBufferPool *pool) const
  {
    gst_buffer_pool_set_active (pool, FALSE);
    gst_object_unref (pool);
  }
};
using PoolPtr = std::unique_ptr<GstBufferPool, PoolRelease>;

using AnyFuser = std::variant<Fuser<std::uint8_t>, Fuser<std::uint16_t>>;

/** Everything that follows from the caps, the schedule and the settings. */
struct Plan {
  Schedule schedule;
  GstVideoInfo coded, fused;
  AnyFuser fuser;
  FrameRate rate;
  SlotPlan slots;
  int lookahead;
  PoolPtr pool;
  /** Null: the camera stands as the schedule has it. */
  std::shared_ptr<const Rectifier> rectifier = nullptr;

  GstClockTime period () const { return boundary (schedule.slots ()); }
  /** Start of slot @p k by even steps, from the frame's PTS. */
  GstClockTime boundary (int k) const
  {
    return GstClockTime (rate.time_of (0, k, schedule.slots ()));
  }
};

/** A coded frame that was taken: everything but its pixels. */
struct Waiting {
  BufferPtr description;
  FrameMeta meta;
};

/** All that is forgotten from PAUSED to READY. Sink pad's stream lock. */
struct Stream : CodedStream {
  Settings settings; ///< in force
  std::optional<Plan> plan;
  /** Significant bits: the property wins over the frames; 0: of the type. */
  int bits_in_force () const
  {
    return settings.options.bits > 0 ? settings.options.bits : bits;
  }
  std::deque<Waiting> waiting; ///< as many as the fuser's pending ()
  bool discont = true;
  guint64 offset = 0;
};

/** Behind the GObject.
 *
 * The object lock of the element is never held while pushing, querying or
 * posting; the stream lock of the sink pad is taken before it. */
struct FuseState {
  GstPad *sinkpad = nullptr;
  GstPad *srcpad = nullptr;

  /* Object lock. */
  Settings settings;
  bool settings_changed = true;
  Counters counters;
  ScheduleRef in_force;     ///< null before the first frame
  bool assumed = false;     ///< in_force came from nowhere
  bool rectifies = false;   ///< a mapping is in force
  GstClockTime latency = 0; ///< that lookahead adds; from the plan
  std::stop_source hurry;   ///< for what nobody waits for any more

  /* Sink pad's stream lock. */
  Stream stream;
};

FuseState &state (GstCodedExposureFuse *self);
/** Ends the fusion of a frame that is under way, which can take seconds. Any
 * thread. */
void hurry (GstCodedExposureFuse *self);
/** Frames are wanted again. */
void take_time (GstCodedExposureFuse *self);
void notify (GstCodedExposureFuse *self, const char *property);

/* Properties. */
void install_properties (GObjectClass *klass);

/* Events and queries. */
gboolean sink_event (GstPad *pad, GstObject *parent, GstEvent *event) noexcept;
gboolean src_event (GstPad *pad, GstObject *parent, GstEvent *event) noexcept;
gboolean sink_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept;
gboolean src_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept;

/* Negotiation. */
/** Makes the plan and sends the caps, where that is due. Posts an error and
 * returns other than OK when there can be no plan.
 * @p next  the frame that comes next, where there is one. */
GstFlowReturn negotiate (GstCodedExposureFuse *self, GstBuffer *next = nullptr);
/** Forwards the events that waited for the caps. */
void settle_events (GstCodedExposureFuse *self);
/** Answers for the CAPS query; Transfer: full. */
GstCaps *sink_caps (GstCodedExposureFuse *self);
GstCaps *src_caps (GstCodedExposureFuse *self);

/* Frames. */
GstFlowReturn chain (GstPad *pad, GstObject *parent, GstBuffer *inbuf) noexcept;
/** Fuses and pushes what waits for frames that will not come. */
GstFlowReturn drain (GstCodedExposureFuse *self);
/** What comes next has nothing to do with what was; what waits is dropped. */
void forget_history (GstCodedExposureFuse *self);

} // namespace cexp::gst::fuse

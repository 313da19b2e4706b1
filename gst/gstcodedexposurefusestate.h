/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What codedexposure-fuse knows, and what its parts call each other for. */
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "base/result.h"
#include "clock/frame_sequence.h"
#include "fuse/fuser.h"
#include "gstcodedexposurefuse.h"
#include "gstcodedexposuremeta.h"
#include "gstraii.h"
#include "schedule/schedule.h"
#include "schedule/stream_setup.h"

GST_DEBUG_CATEGORY_EXTERN (codedexposure_fuse_debug);

namespace cexp::gst::fuse
{

/** What the user asked for. */
struct Settings {
  std::string schedule;
  /** The schedule read from the text; null where the text is empty. */
  std::shared_ptr<const Result<Schedule>> parsed;
  FuseOptions options;
  int rate_num = 0, rate_den = 1; ///< 0/1: only from the caps
};

struct Counters {
  guint64 frames_in = 0;
  guint64 frames_out = 0;
  guint64 frames_lost = 0;
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
struct Stream {
  Stream () { gst_segment_init (&segment, GST_FORMAT_UNDEFINED); }

  CapsPtr caps;
  GstSegment segment;
  /** What the tags of the stream say; an error where they cannot be read. */
  std::optional<Result<StreamSetup>> tagged;
  Settings settings; ///< in force
  std::optional<Plan> plan;
  int bits = 0;      ///< significant ones, as the frames say; 0: they do not
  bool stale = true; ///< the plan has to be made again before the next frame
  /** Serialised events that wait for the caps of the source pad. */
  std::vector<EventPtr> pending;
  std::deque<Waiting> waiting; ///< as many as the fuser's pending ()
  std::optional<FrameSequence> sequence;
  guint64 first_number = 0; ///< of the sequence
  guint64 next_number = 0;
  GstClockTime last_pts = GST_CLOCK_TIME_NONE;
  bool discont = true;
  guint64 offset = 0;
  bool warned_assumed = false;
  bool warned_of_mapping = false;
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
  std::shared_ptr<const Schedule> in_force; ///< null before the first frame
  bool assumed = false;                     ///< in_force came from nowhere
  GstClockTime latency = 0; ///< that lookahead adds; from the plan

  /* Sink pad's stream lock. */
  Stream stream;
};

FuseState &state (GstCodedExposureFuse *self);
void notify (GstCodedExposureFuse *self, const char *property);

/* Properties. */
void install_properties (GObjectClass *klass);
/** Reads @p text, outside of the lock, and keeps both; null for an empty one.
 */
std::shared_ptr<const Result<Schedule>> set_schedule (
    GstCodedExposureFuse *self, const std::string &text);

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
/** Forwards the events that waited for the caps; forgets them where no caps
 * came. */
void settle_pending (GstCodedExposureFuse *self);
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

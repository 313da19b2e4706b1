/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-sim: what a slow camera behind a DMD would see of a video. */
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>
#include <gst/video/gstvideofilter.h>
#include <gst/video/video.h>

#include "base/result.h"
#include "bench/bench.h"
#include "bench/light_share.h"
#include "common/beam.h"
#include "common/element.h"
#include "common/named.h"
#include "common/raii.h"
#include "dmd/simulated_dmd.h"
#include "schedule/schedule.h"
#include "setup/stream_setup.h"

GST_DEBUG_CATEGORY_EXTERN (codedexposure_sim_debug);

namespace codedexposure::gst::sim
{

using ScheduleRef = std::shared_ptr<const Schedule>;

/** Properties. */
struct Settings {
  Beam beam = Beam::kOn;
  Named<Schedule> schedule{"sequential:2x2"};
  std::string dmd;
  Named<BenchProfile> bench;
  /** As they were set; what was not is that of the profile. */
  BenchOptions optics{.psf_sigma = BenchOptions::kUnset,
      .full_well = BenchOptions::kUnset,
      .read_noise = BenchOptions::kUnset};
};

struct Counters {
  guint64 frames_out = 0;
  guint64 frames_dropped = 0;
};

/** Everything that follows from the caps and the schedule. */
struct Plan {
  GstVideoInfo in, out;
  int inputs; ///< input frames in a coded frame
  /** What the slots collect of each of them. */
  std::vector<std::vector<LightShare>> shares;
  /** What falls between the slots, while all mirrors are off, of each; in
   * active times of a slot. */
  std::vector<double> between;
};

/** The coded frame that is being made. */
struct Exposure {
  BufferPtr outbuf;
  GstClockTime start = GST_CLOCK_TIME_NONE; ///< PTS of the first input frame
  std::int64_t frame = 0;
  std::int64_t lost_before = 0; ///< frames that had no light
  std::vector<int> masks;       ///< of each slot; negative: the DMD is parked
  int taken = 0;                ///< input frames
};

/** All that is forgotten from PAUSED to READY. Sink pad's stream lock. */
struct Stream {
  std::shared_ptr<SimulatedMirrors> mirrors;    ///< null: masks in step
  std::unique_ptr<SimulatedMirrors::View> view; ///< of them
  ScheduleRef schedule;                         ///< of the plan and the tag
  std::optional<BenchProfile> profile;
  Beam beam = Beam::kOn;
  /** The schedule with the leak of the profile, as the beam has it. */
  Schedule lit;
  std::optional<Plan> plan;
  std::string refused; ///< why there can be no plan, as was posted
  std::optional<OpticalBench> bench;
  BenchOptions optics; ///< of the bench
  /** The pattern that the DMD holds, and what the camera sees of it. */
  std::shared_ptr<const StillMask> held, seen;
  std::optional<Exposure> exposure;
  /** The exposure that was begun last, kept or dropped. */
  GstClockTime last_start = GST_CLOCK_TIME_NONE;
  std::int64_t last_frame = -1;
  bool discont = true; ///< the next coded frame does not follow the last one
  bool tag_due = true;
  bool mirrors_moved = false;
  std::int64_t parked_frames = 0; ///< in a row
  bool warned_parked = false;
  bool warned_dropped = false;
};

/** The object lock of the element is never held while pushing, querying or
 * posting. */
struct SimState {
  /* Object lock. */
  Settings settings;
  Counters counters;
  /** What caps are made with: that of the stream, else that of the settings. */
  ScheduleRef schedule;
  GstClockTime latency = 0; ///< our own

  /* Sink pad's stream lock. */
  Stream stream;
};

struct GstCodedExposureSim : Instance<GstVideoFilter, SimState> {
};

inline constexpr auto &state = state_in<GstCodedExposureSim>;

/* Negotiation. */
GstCaps *transform_caps (GstBaseTransform *trans, GstPadDirection direction,
    GstCaps *caps, GstCaps *filter);
GstCaps *fixate_caps (GstBaseTransform *trans, GstPadDirection direction,
    GstCaps *caps, GstCaps *othercaps);
gboolean set_info (GstVideoFilter *filter, GstCaps *incaps,
    GstVideoInfo *in_info, GstCaps *outcaps, GstVideoInfo *out_info);
/** Makes the plan for the schedule of the stream. Returns false when there can
 * be none, with an error on the bus that is not repeated. */
bool make_plan (
    GstCodedExposureSim *self, const GstVideoInfo &in, const GstVideoInfo &out);
/** Says on the bus when it is downstream that has no caps for @incaps. */
void explain_refusal (GstCodedExposureSim *self, GstCaps *incaps);

/* Frames. */
/** Looks for the DMD and for what is to be done first; posts an error and
 * returns false when a setting is wrong. */
bool begin_stream (GstCodedExposureSim *self);
/** Takes over a schedule that was changed since the last exposure, or was sent
 * to the DMD. Returns false, with an error on the bus, when there is none. */
bool follow_schedule (GstCodedExposureSim *self);
GstFlowReturn submit_input_buffer (
    GstBaseTransform *trans, gboolean is_discont, GstBuffer *inbuf);
GstFlowReturn generate_output (GstBaseTransform *trans, GstBuffer **outbuf);
enum class Drop { kGap, kSegment, kFlush, kCaps, kEos };
/** Drops the coded frame that is being made, if there is one, and posts it. */
void drop_exposure (GstCodedExposureSim *self, Drop reason);
/** The next frame begins a stretch of time of its own. */
void restart (GstCodedExposureSim *self, Drop reason);
/** What the tag of the coded frames says. */
StreamSetup own_setup (GstCodedExposureSim *self);
/** Says the schedule downstream where that is due. */
void push_tag (GstCodedExposureSim *self);

} // namespace codedexposure::gst::sim

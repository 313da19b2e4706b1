/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync: drives the DMD, and makes time and phase of coded frames known. */
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include "common/beam.h"
#include "common/element.h"
#include "common/events.h"
#include "common/named.h"
#include "common/owned_frames.h"
#include "common/raii.h"
#include "dmd/runner.h"
#include "schedule/schedule.h"
#include "setup/stream_setup.h"
#include "sync/device_clock.h"
#include "sync/frame_sequence.h"
#include "sync/phase_lock.h"
#include "sync/phase_watch.h"
#include "sync/rate_watch.h"
#include "sync/switch_watch.h"

GST_DEBUG_CATEGORY_EXTERN (dmdsync_debug);

namespace codedexposure::gst::sync
{

/** The instant of an exposure that the PTS of incoming frames mean. */
enum class TimestampAt { exposure_start, exposure_end, arrival, device_clock };
/** What takes the place of lost frames. */
enum class OnLoss { gap, repeat, error };
/** What becomes of frames whose masks are not synchronised. */
enum class OnUnlock { keep, skip, error };

/** The device of masks that another program shows. */
inline constexpr const char *kExternal = "external";

struct Settings {
  std::string device;
  Named<Schedule> schedule{"sequential:2x2"};
  Beam beam = Beam::kOn;
  Named<BenchProfile> bench;
  TimestampAt timestamp_at = TimestampAt::exposure_start;
  GstClockTimeDiff exposure_offset = 0;
  OnLoss on_loss = OnLoss::gap;
  OnUnlock on_unlock = OnUnlock::keep;
  std::string pixel_format; ///< empty: as the caps say
};

struct Counters {
  static constexpr const char *kName = "application/x-dmdsync-stats";
  guint64 frames_in = 0;
  guint64 frames_lost = 0;
  guint64 frames_incomplete = 0;
  guint64 frames_late = 0;
  guint64 frames_duplicate = 0;
  guint64 frames_early = 0; ///< dropped: exposed before the stream's time 0
  guint64 frames_skipped = 0;
  guint64 frames_repeated = 0;
  guint64 slips = 0;
  guint64 clock_restarts = 0;
  gdouble clock_drift = 0; ///< ppm by which the camera's clock is fast
  /** By how much PTS may be wrong; none: not known. */
  GstClockTime time_uncertainty = GST_CLOCK_TIME_NONE;
  CODED_FIELDS (frames_in, frames_lost, frames_incomplete, frames_late,
      frames_duplicate, frames_early, frames_skipped, frames_repeated, slips,
      clock_restarts, time_uncertainty, clock_drift);
};

/** Everything that follows from the caps. */
struct Timebase {
  GstVideoInfo info;
  FrameRate rate;
  SlotPlan plan;
};

/** A pattern that replaces the schedule, or is about to. */
struct ShownPattern {
  std::string text;
  guint64 frames_left; ///< until the mirrors are given back unasked
};

/** All that is forgotten from PAUSED to READY. Sink pad's stream lock. */
struct Stream {
  std::optional<Timebase> time;
  std::optional<FrameSequence> sequence;
  std::optional<RateWatch> rate_watch;
  std::optional<OwnedFrames> frames; ///< follows from the caps
  DeviceClock device_clock;
  GstClockTime last_arrival = GST_CLOCK_TIME_NONE;
  GstClockTime last_time = 0; ///< of the newest frame, by the pipeline's clock
  GstClockTime uncertainty = GST_CLOCK_TIME_NONE; ///< of the last frame's time
  std::optional<bool> time_known; ///< as was posted; none: nothing was
  std::optional<PhaseWatch> watch;
  std::optional<PhaseLock> lock;
  BufferPtr last;              ///< for on-loss=repeat
  std::deque<BufferPtr> ready; ///< to be pushed
  SwitchWatch shown;           ///< since the last change of the mirrors
  guint switches = 0;          ///< of which this stream knows
  bool coded = true;           ///< frames are those of the schedule
  bool discont = true;         ///< the next frame does not follow the last one
  bool tag_due = true;
  bool warned_tag = false;
  int unproven = 0; ///< frames in a row whose pilot did not show the phase
  bool warned_pilot = false;
  StreamSetup upstream; ///< as its tag says; its schedule does not count
  std::string refused;  ///< the error of the caps that were refused last
};

/** The object lock of the element is never held while pushing, querying or
 * posting. */
struct SyncState {
  /* Object lock. */
  Settings settings;
  Counters counters;
  std::optional<bool> locked;   ///< of the last frame; none: unknown
  std::optional<Timebase> time; ///< that of the stream
  GstClockTime jitter = 0;      ///< most by which frames came after their time
  GstClockTime latency = 0;     ///< our own
  std::optional<ShownPattern> pattern; ///< none: the schedule
  guint switches = 0;                  ///< between schedule and patterns
  guint seen_switches = 0;             ///< those that frames have shown

  /** Keeps the runner's jobs in the order of the requests; taken before the
   * object lock, and not held while posting. */
  std::mutex pattern_order;

  /** Changed by changes of state only, while nothing flows or is uploaded, and
   * under the object lock: requests of patterns may come at any time. */
  Schedule schedule;
  std::optional<BenchProfile> bench;
  /** Null: no DMD is driven. Changed under the object lock; what may come while
   * the element stops, from another thread than that of the frames, holds it by
   * runner_of (). */
  std::shared_ptr<DmdRunner> runner;

  std::atomic<bool> uploading = false;

  /* Sink pad's stream lock. */
  Stream stream;
};

struct GstDmdSync : Instance<GstBaseTransform, SyncState> {
};

inline constexpr auto &state = state_in<GstDmdSync>;

/* Time. */
/** Follows the settings, the caps and the jitter; posts a message when the
 * latency that they make has changed. */
void update_latency (GstDmdSync *self);
/** By how much PTS are moved back for the settings. Object lock. */
GstClockTimeDiff moved_back (const SyncState &st);
/** The PTS that @p frame came with, by the pipeline's clock. Leaves what it was
 * told from on the frame, which is writable. */
GstClockTime pipeline_time (GstDmdSync *self, GstBuffer *frame);
/** The same for the @p time of a gap, at which no frame came. */
GstClockTime pipeline_time_of_gap (GstDmdSync *self, GstClockTime time);

/** Says it when the times of frames become known well enough, or no longer are.
 */
void say_uncertainty (GstDmdSync *self, guint64 number, GstClockTime pts);
/** Says it when the stream ends long after its last frame. */
void note_end (GstDmdSync *self);
/** Says it when frames come at another rate than that of the caps. */
void watch_rate (GstDmdSync *self, GstClockTime time);

/* What the properties name; false with an error on the bus. */
bool read_schedule (GstDmdSync *self);
/** After open_device (), whose DMD must be that of the profile. */
bool read_bench (GstDmdSync *self);
bool open_device (GstDmdSync *self);
/** Parks the mirrors, whatever they are at. */
void park (GstElement *self);
/** Destroys the runner, or leaves that to whoever still holds it. */
void close_device (GstElement *self);
/** For any thread: keeps the runner beyond a change of state. */
std::shared_ptr<DmdRunner> runner_of (GstDmdSync *self);

/* Patterns, which elements downstream request. */
/** False when the pattern cannot be shown, with a warning that says why. */
bool take_request (GstDmdSync *self, const PatternRequest &request);
MirrorsAnswer describe_mirrors (GstDmdSync *self);
SwitchAnswer describe_switch (GstDmdSync *self);
/** Shows the schedule again. */
void give_back (GstDmdSync *self, const char *reason);
/** The pattern that a frame shows, as in its meta; empty: the schedule. */
std::string look_for_pattern (GstDmdSync *self, GstBuffer *buffer,
    const FrameStep &step, GstClockTime pts);

/* Negotiation and events. */
/** Of the bench profile, in digital numbers; 0: not known. */
int black_level (const SyncState &st);
/** Whether the camera sees the complement of the masks, by which no phase is
 * watched. Takes the object lock. */
bool is_off_beam (GstDmdSync *self);
/** Forgets what frames have shown of the phase. */
void begin_phase (GstDmdSync *self);
gboolean set_caps (GstBaseTransform *trans, GstCaps *incaps, GstCaps *outcaps);
gboolean sink_event (GstBaseTransform *trans, GstEvent *event);
gboolean src_event (GstBaseTransform *trans, GstEvent *event);
gboolean query (
    GstBaseTransform *trans, GstPadDirection direction, GstQuery *query);

/* Frames. */
GstFlowReturn generate_output (GstBaseTransform *trans, GstBuffer **outbuf);

} // namespace codedexposure::gst::sync

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* moirecalib: how the camera lies against the mirrors, live. */
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include "calibrate/session.h"
#include "common/beam.h"
#include "common/element.h"
#include "common/partner.h"
#include "common/raii.h"
#include "report.h"
#include "setup/stream_setup.h"

GST_DEBUG_CATEGORY_EXTERN (moirecalib_debug);

namespace codedexposure::gst::moire
{

/** What to do. */
enum class Mode { automatic, align, map, phase };
using Stage = CalibrationStage;

struct Settings {
  Mode mode = Mode::automatic;
  guint turn = 0; ///< counts settings of the mode
  std::string location, report;
  std::string second_location, second_report;
  std::string pattern;
  std::string schedule; ///< whose tile is looked for; "": the stream's
  Beam beam = Beam::kOn;
  bool overlay = true;
  int period = 12;
  int frames = 4;
  int bits = 0;
  StageOptions stage;

  /** Without patterns the frames are coded frames, which elements downstream
   * decode. */
  bool lays_over () const { return overlay && mode != Mode::phase; }
  /** Text of the pattern that alignment needs. */
  std::string live_pattern () const
  {
    return pattern.empty () ? live_grating ().text () : pattern;
  }
};

/** A frame for the worker: a copy, because a camera may overwrite its memory.
 */
struct Sample {
  BufferPtr frame;
  std::optional<Partner> partner; ///< its copy
  std::string pattern;
  guint64 number = 0;
  GstClockTime pts = 0;
};

/** What a run begins with. */
struct Geometry {
  Mode mode;
  GstVideoInfo info;
  int bits = 0; ///< significant ones, from the frame metadata; 0: unknown
  Extent mirrors;
  std::vector<Pattern> patterns;    ///< of a calibration
  std::optional<Schedule> schedule; ///< of the stream's tags
  bool off_beam = false;            ///< that the camera is in

  Extent camera () const { return {info.width, info.height}; }
};

/** The mapping of a second camera, in the beam of the mirrors that are off,
 * from the partners of the frames of the first. In the worker. */
class SecondSession
{
public:
  /** Beside a run of @p first, with @p settings. */
  SecondSession (const Geometry &first, const Settings &settings)
      : first_ (first), bits_ (settings.bits)
  {
  }

  /** A frame of @p pattern, whose first one says the size of all. */
  void collect (const Pattern &pattern, const Partner &partner);
  /** None: no frame came. */
  Result<std::optional<CalibrationResult>> solve ();

private:
  const Geometry first_;
  const int bits_; ///< that were set; 0: as the frames say
  std::optional<GstVideoInfo> info_;
  std::optional<CalibrationSession> session_;
  std::optional<Error> failure_; ///< the first one
};

/** What the worker has to do. */
struct Queue {
  std::optional<Sample> live;
  std::deque<Sample> samples;
  bool solve = false; ///< after the samples

  bool empty () const { return !live && samples.empty () && !solve; }
};

/** How far a run has come. */
struct Progress {
  Stage stage = Stage::searching;
  double confidence = 0.0;  ///< largest one of a phase
  int readings = 0;         ///< of the live grating
  int aligned_readings = 0; ///< in a row
};

/** The last result: a mapping, or a schedule with the phase that was found. */
struct Finding {
  std::optional<Mapping> mapping, second;
  std::optional<Schedule> schedule;
  bool due = false; ///< to be sent downstream
};

/** Between the streaming thread and the worker. */
struct Exchange {
  /** Covers all of it; never held while pushing, querying or posting. */
  std::mutex lock;
  std::condition_variable changed;
  std::optional<Geometry> geometry;
  guint run = 0; ///< changes when everything begins anew
  Queue queue;
  bool busy = false;
  bool quit = false;
  bool flushing = false; ///< between FLUSH_START and FLUSH_STOP
  /* From the worker: */
  std::shared_ptr<const Panel> panel;
  Progress progress;
  Finding found;
};

/** Reset from PAUSED to READY. Sink pad's stream lock. */
struct Stream {
  std::optional<GstVideoInfo> info;
  std::optional<StreamSetup> setup; ///< from upstream
  std::optional<guint> turn; ///< of the run; none: the next frame begins one
  std::string asked;         ///< the requested pattern
  bool mapping = false;      ///< shows the patterns of a mapping
  std::size_t next = 0;      ///< pattern of the calibration
  int taken = 0;             ///< frames of it
  guint64 frames = 0;        ///< since the last request
};

/** The object lock is never held while pushing, querying or posting. */
struct CalibState {
  Settings settings; ///< object lock
  /** Object lock: JSON, "" before. */
  std::string mapping, second_mapping;
  Stage stage = Stage::searching; ///< object lock: the property

  Exchange exchange;
  std::thread worker;
  Stream stream;
};

struct GstMoireCalib : Instance<GstBaseTransform, CalibState> {
};

inline constexpr auto &state = state_in<GstMoireCalib>;

/* The worker. */
/** False, with an error posted, when no thread can be started. */
bool start_worker (GstMoireCalib *self);
void stop_worker (GstMoireCalib *self);

/* Frames. What GStreamer calls is noexcept: a lack of memory ends the process
 * there, as in GLib. */
/** Makes upstream show the schedule again. From any thread. */
void release_mirrors (GstMoireCalib *self);
GstFlowReturn transform_ip (
    GstBaseTransform *trans, GstBuffer *buffer) noexcept;
gboolean set_caps (
    GstBaseTransform *trans, GstCaps *incaps, GstCaps *outcaps) noexcept;
gboolean sink_event (GstBaseTransform *trans, GstEvent *event) noexcept;

/** Posts a message when it is another one. */
void set_stage (GstMoireCalib *self, Stage stage);

} // namespace codedexposure::gst::moire

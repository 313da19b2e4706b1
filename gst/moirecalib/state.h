/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The state of moirecalib, and what its source files share. */
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "calibrate/session.h"
#include "common/raii.h"
#include "mapping/stream_setup.h"
#include "moirecalib.h"
#include "report.h"

GST_DEBUG_CATEGORY_EXTERN (moirecalib_debug);

namespace codedexposure::gst::moire
{

/** What to do. */
enum class Mode { automatic, align, map, phase };
using Stage = SessionStage;

struct Settings {
  Mode mode = Mode::automatic;
  guint turn = 0; ///< counts settings of the mode
  std::string location;
  std::string report;
  std::string pattern;
  std::string schedule; ///< whose tile is looked for; "": the stream's
  bool overlay = true;
  int period = 12;
  int frames = 4;
  int bits = 0;
  StageOptions stage;

  /** Without patterns the frames are coded frames, which elements downstream
   * decode. */
  bool lays_over () const { return overlay && mode != Mode::phase; }
};

/** A frame for the worker: a copy, because a camera may overwrite its memory.
 */
struct Sample {
  BufferPtr frame;
  std::string pattern;
  guint64 number = 0;
  GstClockTime pts = 0;
};

/** What a run begins with. */
struct Geometry {
  Mode mode;
  GstVideoInfo info;
  int bits = 0; ///< significant ones, from the frame metadata; 0: unknown
  Extent camera;
  Extent mirrors;
  std::vector<Pattern> patterns;    ///< of a calibration
  std::optional<Schedule> schedule; ///< that the stream says
};

/** Between the streaming thread and the worker; its mutex covers all of it. */
struct Exchange {
  std::mutex lock;
  std::condition_variable changed;
  std::optional<Geometry> geometry;
  guint run = 0; ///< changes when everything begins anew
  std::optional<Sample> live;
  std::deque<Sample> samples;
  bool solve = false;
  bool busy = false;
  bool quit = false;
  /* From the worker: */
  std::shared_ptr<const Panel> panel;
  Stage stage = Stage::searching;
  double confidence = 0.0;  ///< largest one of a phase
  int readings = 0;         ///< of the live grating
  int aligned_readings = 0; ///< in a row
  /** The last result, one of these two. */
  std::optional<Mapping> mapping;
  std::optional<Schedule> schedule; ///< with the phase that was found
  bool setup_due = false;           ///< to be sent downstream
};

/** Reset from PAUSED to READY. Sink pad's stream lock. */
struct Stream {
  std::optional<GstVideoInfo> info;
  std::optional<StreamSetup> setup; ///< from upstream
  bool begun = false;
  guint turn = 0;       ///< of the run
  std::string asked;    ///< the requested pattern
  bool mapping = false; ///< shows the patterns of a mapping
  std::size_t next = 0; ///< pattern of the calibration
  int taken = 0;        ///< frames of it
  guint64 frames = 0;   ///< since the last request
};

/** Behind the GObject. The object lock is a leaf. */
struct CalibState {
  Settings settings;              ///< object lock
  std::string mapping;            ///< object lock: JSON, "" before
  Stage stage = Stage::searching; ///< object lock: as properties say it

  Exchange exchange;
  std::thread worker;
  Stream stream;
};

CalibState &state (GstMoireCalib *self);
Settings settings_of (GstMoireCalib *self);

/* The worker. */
/** False, with an error posted, when there is no thread to be had. */
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

/* Messages. */
void set_stage (GstMoireCalib *self, Stage stage);
void say_reading (GstMoireCalib *self, const Sample &sample,
    const LiveReading &reading, const StageCorrection &correction);
void say_progress (
    GstMoireCalib *self, GstProgressType type, const std::string &text);
void say_phase (GstMoireCalib *self, const Sample &sample,
    const CalibrationSession::Phase &found);
void say_mapping (GstMoireCalib *self, const CalibrationResult &result,
    const std::string &location, const std::string &report);

} // namespace codedexposure::gst::moire

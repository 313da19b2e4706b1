/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What moirecalib knows, and what its parts call each other for. */
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

#include "gstmoirecalib.h"
#include "gstraii.h"
#include "moire/calibration.h"
#include "moire/live_moire.h"
#include "moire/stage.h"
#include "moire/tile_phase.h"
#include "overlay/report.h"
#include "schedule/stream_setup.h"

GST_DEBUG_CATEGORY_EXTERN (moirecalib_debug);

namespace cexp::gst::moire
{

/** What the user wants to be done. */
enum class Mode { automatic, align, map, phase };
/** How far that is. The first four are AlignmentState's. */
enum class Stage {
  searching,
  coarse,
  fine,
  aligned,
  mapping, ///< shows the patterns of a calibration, one after the other
  solving,
  mapped,
  failed,
  found, ///< the phase of the tile
};

struct Settings {
  Mode mode = Mode::automatic;
  guint turn = 0; ///< how often the mode was set
  std::string location;
  std::string report;
  std::string pattern;
  std::string schedule; ///< whose tile is looked for; "": the stream's
  bool overlay = true;
  int period = 12;
  int frames = 4;
  int bits = 0;
  StageOptions stage;

  /** Without patterns the frames are pictures, which others take apart. */
  bool lays_over () const { return overlay && mode != Mode::phase; }
};

/** A frame for the worker: a copy, since a camera may use its memory again. */
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
  int bits = 0; ///< significant ones, as the frames say; 0: they do not
  Extent camera;
  Extent mirrors;
  std::vector<Pattern> patterns;    ///< of a calibration
  std::optional<Schedule> schedule; ///< that the stream says
};

/** A phase of this probability is taken. */
constexpr double kSure = 0.999;

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
  double confidence = 0.0;  ///< most that a frame told of the tile
  int readings = 0;         ///< of the live grating
  int aligned_readings = 0; ///< in a row
  /** Where the mirrors stand: of the two, what was found last. */
  std::optional<Mapping> mapping;
  std::optional<Schedule> schedule; ///< with the phase that was found
  bool setup_due = false;           ///< downstream does not have it yet
};

/** All that is forgotten from PAUSED to READY. Sink pad's stream lock. */
struct Stream {
  std::optional<GstVideoInfo> info;
  std::optional<StreamSetup> setup; ///< that upstream said
  bool begun = false;
  guint turn = 0;       ///< that was begun
  std::string asked;    ///< pattern that upstream shows for us, or will
  bool mapping = false; ///< not aligning
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
const char *stage_text (Stage stage);

/* The worker. */
void start_worker (GstMoireCalib *self);
void stop_worker (GstMoireCalib *self);

/* Frames. */
/** Has upstream show the schedule again. From any thread. */
void release_mirrors (GstMoireCalib *self);
GstFlowReturn transform_ip (GstBaseTransform *trans, GstBuffer *buffer);
gboolean set_caps (GstBaseTransform *trans, GstCaps *incaps, GstCaps *outcaps);
gboolean sink_event (GstBaseTransform *trans, GstEvent *event);

/* Messages. */
/** A tile's phase, and the schedule that has it. */
struct FoundPhase {
  TilePhase tile;
  Schedule schedule;
};
void set_stage (GstMoireCalib *self, Stage stage);
void say_reading (GstMoireCalib *self, const Sample &sample,
    const LiveReading &reading, const StageCorrection &correction);
void say_progress (
    GstMoireCalib *self, GstProgressType type, const std::string &text);
void say_phase (
    GstMoireCalib *self, const Sample &sample, const FoundPhase &found);
void say_mapping (GstMoireCalib *self, const CalibrationResult &result,
    const std::string &location, const std::string &report);

} // namespace cexp::gst::moire

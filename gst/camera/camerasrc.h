/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-camerasrc: frames of a GenICam camera. */
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <gst/gst.h>

#include "common/element.h"
#include "common/named.h"
#include "common/owned_frames.h"
#include "common/raii.h"
#include "setup/bench_profile.h"
#include "sync/pause_watch.h"

GST_DEBUG_CATEGORY_EXTERN (camerasrc_debug);

namespace codedexposure::gst::camera
{

/** Which device starts an exposure. */
enum class Trigger { none, dmd, camera };
enum class Edge { rising, falling };

struct Settings {
  std::string name;         ///< as Aravis lists it; empty: the first one
  std::string pixel_format; ///< GenICam name; empty: as the caps say
  Trigger trigger = Trigger::none;
  std::string trigger_line; ///< empty: Line0 for an input, Line1 for an output
  Edge trigger_edge = Edge::rising;
  double exposure_time = 0; ///< microseconds; 0: as the camera has it
  std::string features;     ///< assignments beyond these
  int num_buffers = -1;     ///< frames until EOS; -1: no end
  unsigned reconnect = 0;   ///< tries to restart a camera that went away
  Named<BenchProfile> bench;
};

/** One run, from READY to PAUSED and back. Streaming thread of aravissrc. */
struct Stream {
  bool started = false; ///< STREAM_START was sent
  CapsPtr caps;
  std::optional<GstSegment> segment;
  std::optional<OwnedFrames> frames;
  GstClockTime exposure = GST_CLOCK_TIME_NONE; ///< of all frames; none: unknown
  bool first = true;       ///< the next frame is the first since a start
  GstClockTime origin = 0; ///< running time at which the camera's clock began
  GstClockTime last = GST_CLOCK_TIME_NONE; ///< arrival of the newest frame
};

struct CameraState {
  /* Object lock. */
  Settings settings;
  guint reconnects = 0; ///< times that the camera came back in this run

  /* Set once. Null where aravissrc is not installed. */
  GstElement *source = nullptr;
  GstElement *filter = nullptr; ///< fixes the pixel format

  Stream stream;

  /** Protects what follows; taken after the object lock. Never held while
   * pushing, querying or posting. */
  std::mutex lock;
  std::condition_variable_any changed;
  ObjectPtr<GObject> camera;                    ///< of aravissrc, in this run
  std::chrono::steady_clock::time_point newest; ///< frame, or start of the run
  bool ending = false;  ///< EOS was sent: that aravissrc ends is no error
  bool seen = false;    ///< a frame came in this run
  bool away = false;    ///< the camera failed, and no frame came since
  bool failed = false;  ///< so did the last try
  guint tries = 0;      ///< since it went away
  guint most_tries = 0; ///< before it is given up
  std::string why;      ///< the last try failed
  int frames_left = -1; ///< until EOS; -1: no end
  /** During a run, in which errors may be ours to handle. */
  std::optional<PauseWatch> pauses;
  std::jthread restarts; ///< while the camera is away
};

struct GstCodedExposureCameraSrc : Instance<GstBin, CameraState> {
};

inline constexpr auto &state = state_in<GstCodedExposureCameraSrc>;

/** Sets all properties of aravissrc, which opens the camera. False where that
 * fails; aravissrc has posted an error then. */
bool set_up_source (GstCodedExposureCameraSrc *self);

/** How long the camera exposes each frame, as it says itself once aravissrc has
 * set it up. None: another device says it, or it changes by itself, or the
 * build has no Aravis. */
GstClockTime exposure_of_camera (GstCodedExposureCameraSrc *self);

/** Sees every frame and event that aravissrc pushes, and every query to it. */
GstPadProbeReturn take_item (GstPad *pad, GstPadProbeInfo *info, gpointer self);
/** Sees every answer of aravissrc to a query of downstream. */
GstPadProbeReturn take_answer (
    GstPad *pad, GstPadProbeInfo *info, gpointer self);

/* A camera that goes away. */
void begin_watch (GstCodedExposureCameraSrc *self);
/** Ends all tries; returns when nothing is done to aravissrc any more. */
void end_watch (GstElement *self);
/** Whether the error @p message of a child is handled by a restart. */
bool take_failure (GstCodedExposureCameraSrc *self, GstMessage *message);
/** Makes a camera stop that has sent no complete frame for a second, where the
 * build has Aravis. aravissrc waits for one with its object locked, so that the
 * state of the pipeline cannot change. Its own end follows in two seconds. */
void stop_silent_camera (GstElement *self);
/** Takes the camera of aravissrc, for stop_silent_camera (), or lets go of it:
 * it is controlled by the one who holds it. */
void keep_camera (gpointer self, ObjectPtr<GObject> camera);
/** A frame came. @p silent  time since the one before. */
void note_frame (GstCodedExposureCameraSrc *self, GstClockTime silent);

} // namespace codedexposure::gst::camera

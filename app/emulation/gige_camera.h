/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A simulated GigE Vision camera with given pictures. */
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "base/image.h"
#include "base/packed_mono.h"
#include "base/result.h"
#include "bench/sick_bench.h"
#include "emulation/fault_plan.h"
#include "schedule/timing.h"

namespace codedexposure
{

/** What the camera did with a frame. */
struct SentFrame {
  std::uint64_t frame = 0;
  Nanoseconds device_time = 0; ///< its stamp
  Nanoseconds host_time = 0;   ///< monotonic clock, when its exposure began
  Fault fault = {};
};

/** What a client has set in the camera's registers. */
struct CameraSettings {
  /** A line of the camera. */
  struct Line {
    bool output = false;
    bool exposure_active = false; ///< outputs a level during the exposure
    bool inverted = false;

    bool operator== (const Line &) const = default;
  };

  MonoFormat format = MonoFormat::mono8;
  int width = 0;
  int height = 0;
  double frame_rate = 0; ///< of the trigger, if there is one
  double exposure_us = 0;
  bool triggered = false;
  int trigger_line = 0;
  bool trigger_falling = false;
  Line lines[2];

  bool operator== (const CameraSettings &) const = default;
};

/** "256x192 Mono8, 25 a second, exposure 5000 us, trigger Line0 rising", or
 * "exposure all of the frame"; lines that are outputs follow. */
std::string camera_settings_text (const CameraSettings &settings);

struct GigeCameraOptions {
  /** Address or name of the network interface that it is on. */
  std::string address = "127.0.0.1";
  std::string serial = "CE01";
  int width = 768;
  int height = 576;
  /** Significant bits of the pictures, 1 to 16. */
  int bits = 8;
  /** Frames per second of the hardware trigger. */
  double trigger_rate = 25;
  /** ppm by which the camera's clock is fast. */
  double drift = 0;
  /** Max random delay of a frame. */
  Nanoseconds jitter = 0;
  /** Part of the packets that is lost at random. */
  double packet_loss = 0;
  std::uint64_t seed = 0; ///< of the jitter
  /** Whether it has the feature LineSelector, for lines that are outputs. */
  bool outputs = true;
  FaultPlan faults = {};
  /** Settings of GenICam features that the camera has at first, by name. With
   * any, it has those that a check of a camera looks at, and offers no pixel
   * format of more than `bits` unless `deep` is set. */
  std::map<std::string, std::string> features = {};
  bool deep = false;
  /** In place of Expose: the next exposure and its picture, with the light of
   * its exposure time; none: there was none yet, and the camera asks again. */
  std::function<std::optional<Shot> (ImageView<std::uint16_t> picture)> shoot =
      {};
  /** Called on the camera's thread. */
  std::function<void (const SentFrame &)> sent = {};
  /** Called there before the first frame since a client has started it. */
  std::function<void ()> started = {};
  /** Called there before the first frame with other settings than before. */
  std::function<void (const CameraSettings &)> set_up = {};
};

/**
 * Fills @p picture with exposure number @p frame, counted from the first one
 * that the camera sends: the light on the sensor, 0 .. 2^bits - 1. Called on
 * the camera's thread, which sends late if this takes long. False: there was no
 * exposure, for example no trigger, and nothing is sent.
 */
using Expose =
    std::function<bool (std::uint64_t frame, ImageView<std::uint16_t> picture)>;

/**
 * A monochrome camera that GigE Vision clients find, control and read: Aravis'
 * fake camera with its own pictures, pixel formats and clock.
 *
 * It offers Mono8, Mono10, Mono12, Mono16 and the packed formats of 10 and 12
 * bits; pictures are shifted to the bits of the format, so that white stays
 * white. Triggers (Line0, Line1; either edge) and exposure are features: with a
 * trigger, frames come at its rate; an exposure time shorter than the frame
 * period reduces the light in proportion. Lines can be set as outputs of the
 * exposure, without effect.
 *
 * The time stamp of frame k is k frame periods of the camera's clock, however
 * late the host is: a slow host causes jitter, not losses.
 */
class GigeCamera
{
public:
  /** Starts the camera. Fails if the address is not of this machine. */
  static Result<std::unique_ptr<GigeCamera>> open (
      GigeCameraOptions options, Expose expose);
  virtual ~GigeCamera () = default;

  /** Adds faults while it runs; FaultPlan::add (). Thread-safe. */
  virtual Result<void> add_faults (std::string_view text) = 0;
};

} // namespace codedexposure

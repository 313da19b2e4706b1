/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A GigE Vision camera in software, with pictures of one's own. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "base/image.h"
#include "base/packed_mono.h"
#include "base/result.h"
#include "bench/fault_plan.h"
#include "schedule/timing.h"

namespace codedexposure
{

/** What became of a frame of the camera. */
struct SentFrame {
  std::uint64_t frame = 0;
  Nanoseconds device_time = 0; ///< its stamp
  Nanoseconds host_time = 0;   ///< monotonic clock, when its exposure began
  Fault fault = {};
};

/** What a client has set, as the camera's registers say. */
struct CameraSettings {
  /** A line of the camera. */
  struct Line {
    bool output = false;
    bool exposure_active = false; ///< puts out a level while it exposes
    bool inverted = false;

    bool operator== (const Line &) const = default;
  };

  MonoFormat format = MonoFormat::mono8;
  int width = 0;
  int height = 0;
  double frame_rate = 0; ///< that of the trigger, where there is one
  double exposure_us = 0;
  bool triggered = false;
  int trigger_line = 0;
  bool trigger_falling = false;
  Line lines[2];

  bool operator== (const CameraSettings &) const = default;
};

/** "256x192 Mono8, 25 a second, exposure 5000 us, trigger Line0 rising", or
 * "exposure all of the frame"; lines that put something out follow. */
std::string camera_settings_text (const CameraSettings &settings);

struct GigeCameraOptions {
  /** Address or name of the network interface that it is on. */
  std::string address = "127.0.0.1";
  std::string serial = "CE01";
  int width = 768;
  int height = 576;
  /** Significant bits of the pictures, 1 to 16. */
  int bits = 8;
  /** Frames a second that a hardware trigger makes. */
  double trigger_rate = 25;
  /** ppm by which the camera's clock is fast. */
  double drift = 0;
  /** Every frame is held up by up to this, at random. */
  Nanoseconds jitter = 0;
  /** Part of the packets that is lost, at random. */
  double packet_loss = 0;
  std::uint64_t seed = 0; ///< of the jitter
  FaultPlan faults = {};
  /** Called on the camera's thread. */
  std::function<void (const SentFrame &)> sent = {};
  /** Called there before a frame for which it is set otherwise than before. */
  std::function<void (const CameraSettings &)> set_up = {};
};

/**
 * Fills @p picture with exposure number @p frame, counted from when the camera
 * began to send: what light the sensor saw, 0 .. 2^bits - 1. Called on the
 * camera's thread, which sends late when this takes long. False: there was no
 * exposure, as when the trigger does not come; none is sent.
 */
using Expose =
    std::function<bool (std::uint64_t frame, ImageView<std::uint16_t> picture)>;

/**
 * A monochrome camera that GigE Vision clients find, control and read: Aravis'
 * fake camera with pictures, pixel formats and a clock of its own.
 *
 * It offers Mono8, Mono10, Mono12, Mono16 and the packed formats of 10 and 12
 * bits; pictures are shifted to the format's bits, so that white stays white.
 * Triggers (Line0, Line1; either edge) and exposure are features: with a
 * trigger, frames come at its rate; an exposure time shorter than the frame
 * period lets through as much less light. Lines can be set to put out that it
 * exposes, which goes nowhere.
 *
 * Frame k is stamped with k frame periods by the camera's clock, however late
 * the host is: a host that lags makes jitter, not losses.
 */
class GigeCamera
{
public:
  /** Begins to answer. An error where the address is not this machine's. */
  static Result<std::unique_ptr<GigeCamera>> open (
      GigeCameraOptions options, Expose expose);
  ~GigeCamera ();
  GigeCamera (const GigeCamera &) = delete;
  GigeCamera &operator= (const GigeCamera &) = delete;

  /** Adds faults while it runs; FaultPlan::add (). Thread-safe. */
  Result<void> add_faults (std::string_view text);
  /** Number of the next frame. Thread-safe. */
  std::uint64_t next_frame () const;

private:
  struct State;
  explicit GigeCamera (std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace codedexposure

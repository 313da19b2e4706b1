/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Everything that can be right or wrong with a bench, in numbers. */
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"
#include "bench/lens.h"
#include "mapping/mapping.h"
#include "schedule/timing.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** How the camera is turned against the mirrors, before its small rotation. */
struct Orientation {
  bool flipped_x = false, flipped_y = false;
  int turned = 0; ///< 0, 90, 180 or 270 degrees, from x to y
};

/**
 * A bench: camera, DMD, light and lens. The default is an aligned, healthy one.
 * Words of inflict () change it.
 */
struct SickBenchOptions {
  Extent camera{256, 192};
  Extent mirrors{288, 224}; ///< of the array; the camera looks at its middle
  FrameRate rate = {};      ///< of the trigger
  int bits = 8;
  std::uint64_t seed = 1; ///< of noise, jitter and places of defects

  /* Trigger and exposure. */
  enum class Trigger { good, none, free_running, half_rate, double_rate };
  Trigger trigger = Trigger::good;
  double free_rate = 0.0;        ///< frames/s of a free-running camera
  Nanoseconds delay = 50'000;    ///< from the trigger to the exposure
  Nanoseconds readout = 100'000; ///< what the longest exposure leaves of T
  Nanoseconds edge = 0;          ///< more delay, by a pulse and the wrong edge
  Nanoseconds late = 0;          ///< more delay
  /** The window of the longest exposure ends that long before (> 0) or after
   * (< 0) the end of the period, in place of what follows from the above. */
  std::optional<Nanoseconds> ends_early = {};
  double jitter = 1'000.0; ///< rms, of the delay, ns
  int frame_late = 0;      ///< frame k carries the exposure k - frame_late
  bool late_varies = false;

  /* Light. */
  double level = 0.8; ///< of a full well in the centre, all mirrors on
  double vignetting = 0.0;
  double flicker_rate = 100.0, flicker_depth = 0.0; ///< Hz, amplitude / mean
  double drift = 0.0;                               ///< part of it, per minute
  /** Of a lamp that is dimmed by switching it: pulses/s, part of the time. */
  double pulse_rate = 0.0, pulse_duty = 0.5;
  /** Of the target: how much its brightness varies, and its speed, pixels/s. */
  double texture = 0.0, moving = 0.0;

  /* Sensor. */
  double full_well = 10'000.0; ///< electrons at the largest DN
  double read_noise = 4.0;     ///< electrons rms
  double black_level = 4.0;    ///< DN
  double nonlinear = 0.0;      ///< bow at half the range, part of the range
  double gamma = 1.0;
  double prnu = 0.01; ///< rms difference of the pixels' sensitivity
  int hot_pixels = 0, dead_pixels = 0, missing_bits = 0;
  int dead_rows = 0, dead_blocks = 0; ///< of pixels; a block has 16x16

  /* What the camera does by itself. */
  Nanoseconds rolling = 0; ///< from the exposure of the first row to the last
  double auto_exposure = 0.0, auto_gain = 0.0; ///< mean that it keeps; 0: none
  double black_clamp = 0.0; ///< part of the mean light that black falls by
  double noise_reduction = 0.0, sharpening = 0.0; ///< part of a mean of 3x3
  bool colour = false, lut = false, dark_subtraction = false;
  int low_bits = 0; ///< of 16 that have the values; 0: all

  /* Mirrors. */
  double leak = 0.002;
  Nanoseconds switching = 3'000; ///< time of a linear transition
  int stuck_on = 0, stuck_off = 0;
  int stuck_rows = 0, stuck_blocks = 0; ///< off; a block has 16x16 mirrors
  Orientation orientation = {};

  /* Optics. */
  Alignment alignment = {}; ///< shift: of the camera's centre from the array's
  /** In place of orientation and alignment. */
  std::optional<Mapping> mapping = {};
  double blur = 0.4; ///< standard deviation, pixels
  /** The blur grows by that along the frame, pixels, in that direction. */
  double focus_tilt = 0.0, focus_direction = 0.0;
  int dust = 0;

  /* On the way. */
  double lose = 0.0;          ///< part of the frames that is lost
  double packet_loss = 0.0;   ///< part of the packets
  Nanoseconds slip_every = 0; ///< the masks come a slot later that often; 0: no
  Nanoseconds frame_jitter = 0; ///< max delay of a frame's arrival

  /** What is wrong with parts, by name, such as "dmd-busy"; the value may be
   * empty. */
  std::map<std::string, std::string> parts = {};

  /** At most one: the camera in the beam of the mirrors that are off, with its
   * lens. It looks at the same mirrors and is triggered with the first. */
  std::vector<SickBenchOptions> second = {};

  bool has (const std::string &part) const { return parts.contains (part); }
};

/**
 * Changes @p bench by words NAME[=VALUE] between blanks, such as
 * "flicker=100:0.05 exposure-late=2ms"; fault_help () lists them. Those of a
 * second camera begin with "second:". Changes nothing on an error.
 */
Result<void> inflict (SickBenchOptions &bench, std::string_view words);

/** The words of inflict (), a line each. */
std::string fault_help ();

/** A bench without a fault; every number is drawn from the range in which
 * benches work well. Keeps sizes, rate and bits of @p like. */
SickBenchOptions random_healthy_bench (
    std::uint64_t seed, const SickBenchOptions &like = {});

/** A second camera like that of @p first, whose picture is its mirror image. */
SickBenchOptions second_camera_of (const SickBenchOptions &first);
/** The same, healthy, with numbers of its own. */
SickBenchOptions random_second_camera (const SickBenchOptions &first);

/** Gives @p bench the numbers that were measured of one; those that @p profile
 * does not have stay. */
void replay (SickBenchOptions &bench, const BenchProfile &profile);

} // namespace codedexposure

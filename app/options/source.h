/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where coded frames come from: scene and simulated bench, or a camera with a
 * DMD, or a source of the user. */
#pragma once

#include <functional>

#include "base/geometry.h"
#include "options.h"
#include "schedule/schedule.h"
#include "setup/bench_profile.h"

namespace codedexposure::app
{

/** As given on the command line. */
struct SourceOptions {
  /** Which sources a command has. */
  enum class Kind {
    any,     ///< the simulated bench, a camera, or a source of the user
    watched, ///< the same; the noise is also for fusion, and a liquid is poured
    examined, ///< a bench without a scene, and a camera that the DMD triggers
    simulated ///< the simulated bench alone
  };

  void declare (Options &options, Kind kind = Kind::any);

  /* Scene */
  std::optional<Text> input, scene, pattern;
  std::optional<FrameRate> input_rate;
  std::optional<Extent> size;
  std::optional<int> bits;
  /* Bench */
  std::optional<Text> schedule, bench;
  std::optional<std::uint64_t> seed;
  std::optional<FrameRate> frame_rate;
  std::optional<int> frames;
  std::optional<double> full_well, read_noise, psf_sigma, gain;
  std::optional<double> shift_x, shift_y, rotation, scale;
  /* Camera */
  std::optional<Text> camera, trigger, trigger_line, trigger_edge, pixel_format,
      features, device, source;
  std::optional<double> exposure;
  std::optional<int> reconnect;
  bool off_beam = false; ///< of --bench, the second camera is meant

  bool is_simulated () const { return !camera && !source; }
  std::string schedule_text () const
  {
    return schedule.value_or ("sequential:2x2");
  }

private:
  void declare_scene (Options &options, Kind kind);
  void declare_bench (Options &options, Kind kind);
  void declare_camera (Options &options, Kind kind);
};

/** "30000/1001" */
std::string rate_text (FrameRate rate);

/** A second camera, in the beam of the mirrors that are off. */
struct SecondCamera {
  std::optional<Text> camera; ///< none: a simulated one
  std::optional<Text> bench;  ///< what was measured with it
  std::optional<Extent> size; ///< none: of its bench, or the first's
  /** Changes what a simulated one has of the first; null: its noise only. */
  std::function<void (SourceOptions &)> simulate = nullptr;

  /** Beside --second, which a command declares. */
  void declare (Options &options);
  void declare_relations (Options &options) const;
  /** What the relations between options cannot say; throws Failure.
   * @p first  the camera in the beam of the mirrors that are on. */
  void check (const SourceOptions &first) const;
  /** Those of the first camera, as far as they are also of the second. */
  SourceOptions options (const SourceOptions &first) const;
};

/** The bench profile @p path, which @p option named. Throws Failure. */
BenchProfile bench_of (const char *option, const std::string &path);

/** What follows from the options: what the frames will be. */
struct SourcePlan {
  Schedule schedule;
  FrameRate frame_rate{25, 1};
  /** Of the frames of the input video. */
  FrameRate input_rate{0, 1};
  Extent size{768, 576}; ///< empty: as the camera has it
  int bits = 8;
  std::string pixel_format = "Mono8";
  std::optional<BenchProfile> bench;
  /** A drawn scene begins again after this time; 0: never. */
  std::uint64_t scene_repeat = 0;

  /** Frames of the scene, one a slot. */
  FrameRate scene_rate () const
  {
    return {frame_rate.num * schedule.slots (), frame_rate.den};
  }
  /** Pixels have 16 bits. */
  bool is_deep () const { return bits > 8 || pixel_format != "Mono8"; }
  std::size_t frame_bytes () const
  {
    return std::size_t (size.width) * std::size_t (size.height) *
           (is_deep () ? 2 : 1);
  }

  /** Reads the schedule, the bench profile and the input video. Throws
   * Failure. */
  static SourcePlan make (const SourceOptions &options);
};

} // namespace codedexposure::app

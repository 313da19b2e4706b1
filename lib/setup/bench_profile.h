/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What was measured of a bench: its camera, its DMD and what lies between. */
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"
#include "mapping/mapping.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** A number that was measured, and its standard deviation. */
struct Measured {
  double value = 0.0;
  double sigma = 0.0;

  bool operator== (const Measured &) const = default;
};

/** @p otherwise for what was not measured. */
inline double
value_or (const std::optional<Measured> &number, double otherwise)
{
  return number ? number->value : otherwise;
}

/**
 * The numbers of a bench. What was not measured is absent.
 *
 * Electrons are those of a pixel; DN are digital numbers, the pixel values.
 */
struct BenchProfile {
  /** Bounds on the JSON form, and on the name of a device, in bytes. */
  static constexpr std::size_t kMaxJsonSize =
      2 * (Mapping::kMaxJsonSize + 65536);
  static constexpr std::size_t kMaxName = 128;
  /** An older profile may no longer be that of the bench. */
  static constexpr std::chrono::days kMaxAge{30};

  /** A camera or a DMD; a name that is not known is empty. */
  struct Device {
    std::string vendor = {};
    std::string model = {};
    std::string serial = {};
    Extent size = {}; ///< pixels or mirrors

    bool operator== (const Device &) const = default;
  };

  std::chrono::sys_seconds measured = {}; ///< UTC
  Device camera;
  std::optional<Device> dmd = {};
  std::string pixel_format = {}; ///< GenICam name; empty: not known
  int bits = 8;                  ///< significant bits of a pixel, 1..16
  std::optional<Measured> conversion_gain = {}; ///< e-/DN
  /** Electrons at which a pixel is saturated: the well is full, or the largest
   * DN is reached. */
  std::optional<Measured> full_well = {};
  std::optional<Measured> read_noise = {};  ///< e- rms
  std::optional<Measured> black_level = {}; ///< DN without light
  /** Largest deviation from a straight line, as a part of the range. */
  std::optional<Measured> linearity_error = {};
  std::optional<Measured> leak = {}; ///< as Schedule::leak ()
  /** From the start of a frame's first slot to that of the exposure, ns. */
  std::optional<Measured> trigger_delay = {};
  std::optional<Measured> exposure = {};  ///< true duration, ns
  std::optional<Measured> psf_sigma = {}; ///< blur, as of Mapping
  std::optional<Mapping> mapping = {};
  /** DN of light that goes to this second camera for each DN of the first one,
   * where the same mirrors are on for the same time. */
  std::optional<Measured> light_ratio = {};
  /** One profile at most: that of a second camera, in the beam of the mirrors
   * that are off. It has none itself. */
  std::vector<BenchProfile> second = {};

  /** What was measured with one of the cameras: the second one @p off_beam, if
   * there is one, else the first. */
  BenchProfile of_beam (bool off_beam) const;

  /** The mapping, or that of an aligned camera with the blur that was measured;
   * none: neither is known. */
  std::optional<Mapping> known_mapping () const;

  /** The strict, versioned text form: see docs/formats.md. */
  static Result<BenchProfile> from_json (std::string_view json);
  /** JSON, which begins with '{', or the path of a file. */
  static Result<BenchProfile> parse (std::string_view json_or_path);
  /** One line; equal profiles have equal texts. */
  std::string to_json () const;
  /** to_json () into a file, which gets its name when it is complete. Fails
   * like check (), too. */
  Result<void> save (const std::string &path) const;
  /** Error when a number is out of its range or not finite, or contradicts
   * another. */
  Result<void> check () const;

  /** Names and values for people. */
  std::vector<std::pair<std::string, std::string>> rows () const;

  /** The largest DN. */
  int largest () const { return (1 << bits) - 1; }
  /** The conversion gain, e-/DN; if it was not measured, that of a full well at
   * the largest DN; none: not known. */
  std::optional<double> electrons_per_number () const;
  /** Black level to the nearest DN; 0: not known. */
  int black () const;
  /** @p schedule with the leak that was measured, unless it has one. */
  Result<Schedule> with_leak (const Schedule &schedule) const;

  /** Error where frames cannot be of this camera. @p bits: significant ones; 0:
   * not known. */
  Result<void> check_frames (Extent size, int bits) const;
  /** Error where a serial number is known in both and differs. @p what, such as
   * "camera", is for the message. */
  static Result<void> check_device (
      const std::string &what, const Device &profiled, const Device &found);
  /** check_device () of camera and DMD of another profile of the same bench. */
  Result<void> check_bench (const BenchProfile &other) const;
  /** What to say of a profile that at @p now is older than kMaxAge, or not yet
   * measured; none otherwise. */
  std::optional<std::string> why_doubtful (std::chrono::sys_seconds now) const;

  bool operator== (const BenchProfile &) const = default;
};

/** The time by the clock of the machine. */
inline std::chrono::sys_seconds
now_utc ()
{
  return std::chrono::floor<std::chrono::seconds> (
      std::chrono::system_clock::now ());
}

} // namespace codedexposure

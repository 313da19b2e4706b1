/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Camera against mirrors from a single frame of one grating. */
#pragma once

#include <cstdint>
#include <memory>

#include "base/image.h"
#include "base/result.h"
#include "schedule/mapping.h"

namespace cexp
{

/** What a frame of the live grating says. */
struct LiveReading {
  /**
   * An affine mapping with its covariance. A grating says where a pixel looks
   * but for whole periods: of those, the one nearest to the mapping that was
   * expected.
   */
  Mapping mapping;
  /** Amplitude of the fringes in x and y as a part of the largest that a
   * grating of this period and a camera of square pixels without gaps can
   * have; about 1 in focus, less when out of it. */
  Position contrast;
  /** Part of the frame that shows the grating. */
  double coverage = 0.0;
  std::uint64_t saturated = 0; ///< pixels at the largest value
};

/**
 * Sampling moiré of live_grating (): every T-th pixel, T pixels being nearest
 * to the period, at T shifts, interpolated (Ri's method; science of phase in
 * docs/calibration.md). Phase and amplitude come in blocks of T x T pixels, in
 * which the other direction's grating averages out.
 *
 * Not for two threads at a time; solve () allocates nothing.
 */
class LiveMoire
{
public:
  struct Options {
    int period = 4; ///< mirrors, as in live_grating ()
    int bits = 0;   ///< significant ones of a pixel; 0: all of its type
  };

  /** @p expected  where the camera is thought to stand; a Mapping (Extent) of
   *               the camera's size will do where both are nearly aligned.
   * Error when a period has less than 3 or more than 64 pixels, or the frame
   * not 8 periods. */
  static Result<LiveMoire> make (const Mapping &expected);
  static Result<LiveMoire> make (
      const Mapping &expected, const Options &options);
  LiveMoire (LiveMoire &&) noexcept;
  LiveMoire &operator= (LiveMoire &&) noexcept;
  ~LiveMoire ();

  /** Pixels from one sample to the next, T. */
  int sampling () const;

  /** @p frame of the expected mapping's camera size. Error when it shows no
   * grating. */
  Result<LiveReading> solve (ImageView<const std::uint8_t> frame);
  Result<LiveReading> solve (ImageView<const std::uint16_t> frame);

  /** Of the frame solved last, for each block of T x T pixels: phase of the
   * moiré fringes in radians, -pi..pi, in x and in y, and their amplitude in
   * numbers of the camera. */
  ImageView<const float> phase (bool y) const;
  ImageView<const float> amplitude (bool y) const;

private:
  struct State;
  explicit LiveMoire (std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace cexp

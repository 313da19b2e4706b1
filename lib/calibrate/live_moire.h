/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The mapping from a single frame of a grating. */
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "base/image.h"
#include "base/result.h"
#include "calibrate/fringes.h"
#include "mapping/mapping.h"

namespace codedexposure
{

/** The result of one frame of the live grating. */
struct LiveReading {
  /**
   * An affine mapping with its covariance. A grating determines it up to whole
   * periods; the one closest to the expected mapping is taken.
   */
  Mapping mapping;
  /** Amplitude of the fringes in x and y, relative to the largest amplitude for
   * a grating of this period and square pixels without gaps; about 1 in focus.
   */
  Position contrast;
  /** Part of the frame that shows the grating. */
  double coverage = 0.0;
  std::uint64_t saturated = 0; ///< pixels at the largest value
};

struct LiveMoireOptions {
  int period = 4;        ///< mirrors, as in live_grating ()
  int bits = 0;          ///< significant ones of a pixel; 0: all of its type
  bool off_beam = false; ///< the frame is of the beam of mirrors that are off
};

/**
 * Sampling moiré of live_grating (): every T-th pixel at T shifts,
 * interpolated, where T is the period of the grating in pixels, rounded (Ri's
 * method; see docs/calibration.md). Phase and amplitude are those of blocks of
 * T x T pixels, over which the grating of the other direction averages out.
 *
 * Not thread-safe; solve () allocates nothing.
 */
class LiveMoire
{
public:
  /** @p expected  approximate mapping; a Mapping (Extent) of the camera's size
   *               suffices if both are nearly aligned.
   * Error when a period has less than 3 or more than 64 pixels, or the frame
   * has less than 8 periods. */
  static Result<LiveMoire> make (
      const Mapping &expected, const LiveMoireOptions &options = {});
  LiveMoire (LiveMoire &&) noexcept = default;
  LiveMoire &operator= (LiveMoire &&) noexcept = default;

  /** @p frame of the expected mapping's camera size. Error when it has another
   * one or shows no grating. */
  Result<LiveReading> solve (ImageView<const std::uint8_t> frame);
  Result<LiveReading> solve (ImageView<const std::uint16_t> frame);

  /** Of the last frame; a block has T x T pixels, amplitudes are in DN. */
  FringePair fringes () const;

private:
  struct State;
  explicit LiveMoire (std::shared_ptr<State> state) : state_ (std::move (state))
  {
  }
  std::shared_ptr<State> state_;
};

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One calibration on the simulated bench, and the bound of its accuracy. */
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/lens.h"
#include "calibrate/calibration.h"

namespace codedexposure::quality
{

/** Errors, or their standard deviations. */
struct Deviation {
  double field = 0.0; ///< rms over pixels that see mirrors, per axis, mirrors
  double shift_x = 0.0, shift_y = 0.0; ///< at the centre, mirrors
  double rotation = 0.0;               ///< radians
  double scale = 0.0;                  ///< of magnification
};

/** Where a camera stands, and how sharp it sees. */
struct MoireTrial {
  Alignment alignment;
  double psf_sigma = 0.5;
  std::uint64_t seed = 0;
};

/** The result. */
struct MoireOutcome {
  std::string failure = {}; ///< empty: none
  Deviation error = {};
  double worst = 0.0; ///< largest distance of such a pixel, mirrors
  Deviation stated = {};
  /** Cramér-Rao bounds of the same frames: each pixel's level and swing and the
   * blur unknown, mapping a homography, or known to be affine. */
  Deviation bound = {}, affine_bound = {};
  bool displaced = false; ///< a displacement grid was added
  double seconds = 0.0;   ///< of the solution
};

/** The bench: 768x576 pixels and mirrors, light 200 of 255, full well of 10000
 * electrons, read noise of 5, 8 bits. */
constexpr Extent kMoireSize = {768, 576};
constexpr double kMoireLight = 200.0;
constexpr double kMoireWell = 10000.0;
constexpr double kMoireRead = 5.0;

MoireOutcome run_moire (const MoireTrial &trial);

/** @p mapped  (x, y) to the mirror that a method says. */
Deviation deviation_of (const std::function<Position (double, double)> &mapped,
    const Alignment &truth, double *worst = nullptr);

/** A frame of any pattern of mirrors (nonzero: on) on the same bench. */
Image<std::uint8_t> moire_frame (const MoireTrial &trial,
    ImageView<const std::uint8_t> mirrors, std::uint64_t number);

} // namespace codedexposure::quality

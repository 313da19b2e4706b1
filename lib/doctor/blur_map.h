/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The blur of the mirrors' picture over the frame, and what it says of focus.
 */
#pragma once

#include <optional>
#include <vector>

#include "base/image.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** Blur of blocks of pixels. */
struct BlurMap {
  int block = 16; ///< pixels, side of a block
  /** Variance of a Gaussian between mirrors and pixels, pixels squared;
   * negative: not known. */
  Image<float> variance;
  Image<float> sigma; ///< of the variance

  double median () const; ///< of the known ones, standard deviation, pixels
};

/** Pictures of gratings that were moved, mirror by mirror, through a period. */
struct GratingStack {
  /** One for each phase, DN: every @ref step th pixel of every so many rows. */
  std::vector<Image<float>> x, y;
  int step = 1;
  Image<float> dark, white;
};

/**
 * From the harmonics of the light of each pixel over the phases.
 *
 * @p good: pixels that count. @p magnification: pixels a mirror. @p mapping: of
 * the pixels; null: not known, which costs accuracy where the blur is small.
 */
BlurMap map_blur (const GratingStack &stack, ImageView<const std::uint8_t> good,
    double magnification, const Mapping *mapping);

/** A plane of sharp focus that is tilted against the camera's. */
struct FocusTilt {
  /** Towards where the blur grows, degrees, from x to y: 0 is to the right, 90
   * is down. */
  Measured direction;
  /** By how much the standard deviation of the defocus grows from one border
   * of the frame to the other along that direction, pixels. */
  Measured growth;
  double sharpest = 0.0; ///< blur without the defocus, pixels
};

/** Defocus that is a plane over the frame, whose blur adds to an even one. None
 * with too few blocks. */
std::optional<FocusTilt> fit_focus (const BlurMap &map, Extent camera);

} // namespace codedexposure

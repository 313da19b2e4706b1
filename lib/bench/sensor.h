/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* From light to digital numbers (DN): electrons, noise, converter. */
#pragma once

#include <cstdint>

#include "base/image.h"

namespace codedexposure
{

/**
 * A sensor, linear unless it has a bow. Its unit of light is white during a
 * whole exposure with the mirror on in every slot.
 */
struct Sensor {
  double full_well = 0.0;   ///< electrons at unit light; 0: noise-free
  double well = 0.0;        ///< most electrons that a pixel holds; 0: full_well
  double read_noise = 0.0;  ///< electrons rms
  double gain = 1.0;        ///< at 1, unit light makes the largest DN
  double black_level = 0.0; ///< DN that is added to all pixels
  int bits = 8;             ///< of the converter, 1..16
  std::uint64_t seed = 0;
  /** How much more than linear half of the range is, as a part of the range;
   * the error is a parabola. Without noise, not in force. */
  double bow = 0.0;

  /**
   * Digital numbers of frame @p frame: Poisson electrons, clamped to the well,
   * Gaussian read noise, gain, black level, rounding (half up), clamp to
   * 0..2^bits - 1.
   *
   * The noise of a pixel depends only on the seed, the frame and its position.
   * Poisson numbers are exact below a mean of 16 electrons; above, the error of
   * their distribution is less than 6e-5 (total variation).
   *
   * @p light  light of each pixel times @p unit.
   */
  template <typename Pixel>
  void read_out (ImageView<const float> light, double unit, std::uint64_t frame,
      ImageView<Pixel> out) const;
};

} // namespace codedexposure

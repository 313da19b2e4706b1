/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* From light to the camera's numbers: electrons, noise, converter. */
#pragma once

#include <cstdint>

#include "base/image.h"

namespace codedexposure
{

/**
 * A linear sensor. Its unit of light is white through a whole exposure: every
 * slot open.
 */
struct Sensor {
  double full_well = 0.0;  ///< electrons that unit light makes; 0: noise-free
  double read_noise = 0.0; ///< electrons rms
  double gain = 1.0;       ///< at 1, unit light makes the largest number
  int bits = 8;            ///< of the converter, 1..16
  std::uint64_t seed = 0;

  /**
   * Numbers for the light of frame @p frame: Poisson electrons, no more than
   * the full well, Gaussian read noise, gain, rounding (half up), clamp to
   * 0..2^bits - 1.
   *
   * A pixel's noise depends on the seed, the frame and its position, and on
   * nothing else. Poisson numbers are exact below a mean of 16 electrons;
   * above, their distribution is off by less than 6e-5 in all (total
   * variation).
   *
   * @p light  light of each pixel times @p unit: what unit light stands for.
   */
  template <typename Pixel>
  void read_out (ImageView<const float> light, double unit, std::uint64_t frame,
      ImageView<Pixel> out) const;
};

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Moiré fringes as pictures. */
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "base/statistics.h"

namespace codedexposure
{

/** Moiré fringes, one value for each block of pixels. */
struct Fringes {
  Image<float> phase;     ///< radians, -pi..pi
  Image<float> amplitude; ///< any unit

  /** Amplitude at which fringes are drawn with full contrast. */
  float full_amplitude () const
  {
    float most = 0.0f;
    each_pixel (amplitude,
        [&] (int x, int y) { most = std::max (most, amplitude.at (x, y)); });
    return most / 2;
  }
  /** cos of the phase of block (@p x, @p y), as 0..255; dark where there is no
   * amplitude. @p full: full_amplitude (). */
  std::uint8_t grey (int x, int y, float full) const
  {
    const float contrast =
        full > 0.0f ? std::min (1.0f, amplitude.at (x, y) / full) : 0.0f;
    return std::uint8_t (
        127.5f * contrast * (1.0f + std::cos (phase.at (x, y))));
  }
};

/** Fringes in both directions at one time. */
struct FringePair {
  Fringes x, y;
  std::string caption = {};
};

} // namespace codedexposure

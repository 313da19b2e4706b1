/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Moiré fringes as pictures. */
#pragma once

#include <cstdint>
#include <string>

#include "base/image.h"

namespace codedexposure
{

/** Moiré fringes, one value for each block of pixels. */
struct Fringes {
  Image<float> phase;     ///< radians, -pi..pi
  Image<float> amplitude; ///< any unit

  /** Amplitude at which fringes are drawn with full contrast. */
  float full_amplitude () const;
  /** cos of the phase of block (@p x, @p y), as 0..255; dark where there is no
   * amplitude. @p full: full_amplitude (). */
  std::uint8_t grey (int x, int y, float full) const;
};

/** Fringes in both directions at one time. */
struct FringePair {
  Fringes x, y;
  std::string caption = {};
};

} // namespace codedexposure

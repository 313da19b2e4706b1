/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One picture of even light in a few numbers. */
#pragma once

#include <cstdint>

#include "base/image.h"

namespace codedexposure
{

/** The pixel values (DN) of a picture as a whole. */
struct Level {
  double mean = 0.0;
  /** Standard deviation of a pixel against its neighbour. A few pixels that
   * are far off do not count. */
  double noise = 0.0;
  double saturated = 0.0; ///< part of the pixels at the largest DN
  /** Bits that are set in any pixel. */
  std::uint16_t bits_seen = 0;
};

/** @p largest: the largest DN; larger ones count as that. */
Level level_of (ImageView<const std::uint16_t> picture, int largest);

/**
 * Standard deviation of the error of a mean that is due to rounding, in DN.
 * Noise of half a step makes it vanish.
 *
 * @p noise  of a pixel, with that of rounding. @p step  between two DN; more
 * than 1 if the lowest bits are missing.
 */
double rounding_doubt (double noise, int step);

} // namespace codedexposure

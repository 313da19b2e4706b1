/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A picture in a few numbers: its level, and how light falls off over it. */
#pragma once

#include <cstdint>
#include <vector>

#include "base/image.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** The mean of @p values and their standard deviation; 0 without values. */
Measured spread_of (const std::vector<double> &values);

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

/** Means of the first and of the last quarter of the rows of a frame, DN. */
struct BorderLight {
  double first = 0.0, last = 0.0;
};
BorderLight border_light (ImageView<const std::uint16_t> picture);

/**
 * Light that the darkest corner loses against the centre of @p picture, as a
 * part; negative if it is the brighter one. It is that of a smooth surface:
 * dust, odd pixels and a part that sees no mirror do not count. NaN if too few
 * pixels see mirrors.
 *
 * @p picture  of all mirrors on, less that of all mirrors off
 */
Measured corner_loss (ImageView<const float> picture);

/** @p image without what is smaller than some ten pixels, such as defects: the
 * medians of blocks, bilinear between their centres and beyond them. @p good:
 * pixels that count; none: all. */
Image<float> smooth (
    const Image<float> &image, ImageView<const std::uint8_t> good = {});

/** @p light by the surface of fourth order that fits its @p good pixels: light
 * that falls off is even then, without steps between blocks. */
Image<float> flattened (
    const Image<float> &light, ImageView<const std::uint8_t> good);

} // namespace codedexposure

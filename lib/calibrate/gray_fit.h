/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Fits the mapping to Gray codes, to a fraction of a stripe; for this folder
 * only.
 */
#pragma once

#include <cstdint>

#include "base/image.h"
#include "base/result.h"
#include "mapping/mapping.h"

namespace codedexposure
{

/** What pixels see of the Gray code of one axis. */
struct GrayCode {
  int width = 1; ///< of a stripe, mirrors
  /** Bit 0 is the finest: whether the frame is brighter than its inverse. */
  Image<std::uint16_t> bits = {};

  /** Centre of the stripe that a pixel sees, in mirrors. */
  double mirror_at (int x, int y) const;
};

/** A centred homography, by least squares over the pixels that are marked @p
 * usable. Outliers are left out. Error when fewer than half of the pixels agree
 * with one mapping. */
Result<Homography> fit_gray_codes (
    const GrayCode &x, const GrayCode &y, ImageView<const std::uint8_t> usable);

} // namespace codedexposure

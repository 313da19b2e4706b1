/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The mapping to a fraction of a stripe, from Gray codes; for the sources of
 * lib/moire only. */
#pragma once

#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "schedule/mapping.h"

namespace cexp
{

/** The Gray code of one axis, as a camera saw it. */
struct GrayCode {
  int width = 1; ///< of a stripe, mirrors
  /** Of each bit, the finest first: frame less frame of the inverse. */
  std::vector<Image<float>> bits;

  /** Middle of the stripe that a pixel sees, in mirrors. */
  double mirror_at (int x, int y) const;
};

/** A centred homography, or with @p affine one whose numbers 6 and 7 are 0, by
 * least squares over the pixels that are marked @p usable. Pixels that decode
 * to somewhere else are left out. */
Result<Homography> fit_gray_codes (const GrayCode &x, const GrayCode &y,
    ImageView<const std::uint8_t> usable, bool affine);

} // namespace cexp

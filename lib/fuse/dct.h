/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The orthonormal cosine transform. */
#pragma once

#include <vector>

#include "fuse/kernels.h"

namespace codedexposure::fuse
{

/** The first half of the rows of the orthonormal DCT-II of length kBlock: at
 * [k][i] of element i; the second half mirrors it, odd k with the sign changed.
 */
struct DctTable {
  float at[kBlock][kBlock / 2];
};

extern const DctTable kDct;

/** DCT-II of @p length values as a matrix, row-major, a frequency a row. */
std::vector<float> dct_matrix (int length);

} // namespace codedexposure::fuse

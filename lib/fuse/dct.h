/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The cosines of the blocks' transform. */
#pragma once

#include "fuse/kernels.h"

namespace cexp::fuse
{

/** The first half of the rows of the orthonormal DCT-II of length kBlock: at
 * [k][i] of element i; the second half mirrors it, odd k with the sign changed.
 */
struct DctTable {
  float at[kBlock][kBlock / 2];
};

extern const DctTable kDct;

} // namespace cexp::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The orthonormal cosine transform as a matrix. */
#pragma once

#include <vector>

namespace cexp::fuse
{

/** DCT-II of @p length values, row-major, a frequency a row. */
std::vector<float> dct_matrix (int length);

} // namespace cexp::fuse

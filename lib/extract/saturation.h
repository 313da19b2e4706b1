/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Pixels at the largest value, of which nothing more is known. */
#pragma once

#include <cstdint>

#include "base/image.h"

namespace codedexposure
{

/** Pixels of @p frame that are at 2^bits - 1 or above.
 * @p bits significant ones, 1 to those of the type; 0: all of the type. */
template <typename Pixel>
std::uint64_t count_saturated (ImageView<const Pixel> frame, int bits);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The hash by which a recorded frame is recognised. */
#pragma once

#include <cstdint>

#include "base/image.h"

namespace codedexposure
{

/** XXH3 (64 bits, seed 0) of the pixels, row by row without padding; 16-bit
 * pixels as two bytes, the low one first. */
template <typename Pixel>
std::uint64_t pixel_hash (ImageView<const Pixel> pixels);

} // namespace codedexposure

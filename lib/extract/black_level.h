/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The black level of a camera, which is not light. */
#pragma once

#include <cstdint>

#include "base/image.h"

namespace codedexposure
{

/** Writes @p frame less @p black, at least 0, to @p light, which has its size.
 * Saturated pixels stay saturated: they are at 2^bits - 1 or above.
 * @p bits significant ones, 1 to those of the type; 0: all of the type. */
template <typename Pixel>
void subtract_black (
    ImageView<const Pixel> frame, int black, int bits, ImageView<Pixel> light);

} // namespace codedexposure

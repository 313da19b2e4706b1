/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The run-length code in which a DLPC900 takes its images. */
#pragma once

#include <cstdint>

#include "base/image.h"
#include "dmd/little_endian.h"

namespace cexp
{

/** The 24 bit-planes of a mirror: plane b is bit b. The top byte is 0. */
using PlanePixel = std::uint32_t;

/** To a multiple of so many bytes, an encoded image is padded. */
constexpr std::size_t kErleUnit = 4;

/**
 * Enhanced run-length encoding: runs of one pixel, copies from the row above,
 * literals. No run crosses a row, so that the code of a row depends on itself
 * and the row above only. Padded with zeros to a multiple of @p unit bytes.
 *
 * @p image  1..32767 pixels wide.
 *
 * It packs what is constant along a row or a column. Masks whose period is
 * above 1 in both directions stay at 3 bytes a pixel.
 */
Bytes encode_erle (
    ImageView<const PlanePixel> image, std::size_t unit = kErleUnit);

/** The size of encode_erle () without the bytes. */
std::size_t erle_size (
    ImageView<const PlanePixel> image, std::size_t unit = kErleUnit);

} // namespace cexp

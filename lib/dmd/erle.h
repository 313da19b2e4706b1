/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The run-length code in which a DLPC900 takes its images. */
#pragma once

#include <cstdint>
#include <vector>

#include "dmd/bytes.h"
#include "schedule/mask_renderer.h"

namespace codedexposure
{

/** The 24 bit-planes of a mirror: plane b is bit b. The top byte is 0. */
using PlanePixel = std::uint32_t;

/** To a multiple of so many bytes, an encoded image is padded. */
constexpr std::size_t kErleUnit = 4;

/** Three bytes a pixel, as on the wire: planes 16..23 come first. */
void append_pixels (Bytes &bytes, const PlanePixel *pixels, int count);

/** Bytes in pieces, of which each distinct one is kept once. */
struct PiecedBytes {
  std::vector<Bytes> pieces;
  std::vector<int> order;
  std::size_t size = 0; ///< of all together

  void add (int piece);
  void add (Bytes piece);
  Bytes joined () const;
};

/**
 * Enhanced run-length encoding: runs of one pixel, copies from the row above,
 * literals. No run crosses a row, so that the code of a row depends on itself
 * and the row above only. Padded with zeros to a multiple of @p unit bytes.
 *
 * @p image    columns [x, x + width) of it are taken.
 * @p width    1..32767.
 *
 * It packs what is constant along a row or a column. Masks whose period is
 * above 1 in both directions stay at 3 bytes a pixel.
 */
PiecedBytes encode_erle (const MirrorRows<PlanePixel> &image, int x, int width,
    std::size_t unit = kErleUnit);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The run-length code of images for a DLPC900. */
#pragma once

#include <cstdint>
#include <vector>

#include "dmd/bytes.h"
#include "schedule/mask_renderer.h"

namespace codedexposure
{

/** The 24 bit-planes of a mirror: plane b is bit b. The top byte is 0. */
using PlanePixel = std::uint32_t;

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
 * literals. No run crosses a row, so that the code of a row depends only on the
 * row and the one above. Padded with zeros to a multiple of 4 bytes.
 *
 * @p image    of which columns [x, x + width) are encoded.
 * @p width    1..32767.
 *
 * It compresses what is constant along a row or a column. Masks with a period
 * above 1 in both directions stay at 3 bytes per pixel.
 */
PiecedBytes encode_erle (const MirrorRows<PlanePixel> &image, int x, int width);

} // namespace codedexposure

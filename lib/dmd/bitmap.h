/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Masks as Windows bitmap files, for TI's boards and programs. */
#pragma once

#include "dmd/bytes.h"
#include "dmd/erle.h"

namespace codedexposure
{

/** Appends @p size bytes with a bit for each mirror of @p row, of which the
 * highest bit of the first one is the left mirror, and zeros. */
void append_bits (Bytes &bytes, const MirrorRows<std::uint8_t> &mirrors,
    int row, std::size_t size);

/** A binary mask, 1 bit a mirror, 1 is on. */
Bytes encode_bitmap (const MirrorRows<std::uint8_t> &mirrors);

/** 24 planes in the channels in which a DLPC350 looks for them: planes 0..7 in
 * green, 8..15 in red, 16..23 in blue. */
Bytes encode_plane_bitmap (const MirrorRows<PlanePixel> &planes);

} // namespace codedexposure

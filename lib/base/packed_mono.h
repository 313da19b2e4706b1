/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Grey values of 10 and 12 bits as cameras pack them. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "base/image.h"
#include "base/result.h"

namespace codedexposure
{

/**
 * How pixels lie in the bytes of a row. The names are GenICam's; the "Packed"
 * ones of GigE Vision 1 and the "p" ones of PFNC differ.
 *
 *   mono10_packed, mono12_packed  two pixels in three bytes: the upper eight
 *                                 bits of each in the outer ones, the lower
 *                                 bits of both in the middle one
 *   mono10p, mono12p              a stream of bits, lowest first, without gaps
 */
enum class MonoFormat {
  mono8,
  mono10,
  mono12,
  mono16,
  mono10_packed,
  mono12_packed,
  mono10p,
  mono12p,
};

/** "Mono12Packed"; none for another name. Case does not matter. */
std::optional<MonoFormat> parse_mono_format (std::string_view name);
const char *mono_format_text (MonoFormat format);

/** Significant bits: values are 0 .. 2^bits - 1. */
int significant_bits (MonoFormat format);
/** Bits that a pixel takes in memory. */
int stored_bits (MonoFormat format);
/** Bytes of a row of @p width pixels, the last one filled up. */
std::size_t row_bytes (MonoFormat format, int width);

/**
 * Packed rows to one value of 16 bits a pixel, in host order, not shifted.
 *
 * @p rows  row_bytes () wide each, any stride; width is in bytes.
 * @p out   height as @p rows; must not overlap them.
 * @return an error when a row of @p rows is shorter than @p out needs.
 */
Result<void> unpack_mono (MonoFormat format, ImageView<const std::uint8_t> rows,
    ImageView<std::uint16_t> out);
/** The inverse; where pixels are packed, bits above the significant ones are
 * left out. */
Result<void> pack_mono (MonoFormat format, ImageView<const std::uint16_t> in,
    ImageView<std::uint8_t> rows);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/packed_mono.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>

#include "base/geometry.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

/* Each reads or writes one row; a row that ends inside a byte or a triple of
 * them needs no more bytes than row_bytes (). */

/* Two pixels in three bytes; kLow bits of each are in the middle byte. */
template <int kLow>
void
unpack_triples (const std::uint8_t *in, std::uint16_t *out, int width)
{
  constexpr int kMask = (1 << kLow) - 1;
  int x = 0;
  for (; x + 1 < width; x += 2, in += 3) {
    out[x] = std::uint16_t (in[0] << kLow | (in[1] & kMask));
    out[x + 1] = std::uint16_t (in[2] << kLow | (in[1] >> 4 & kMask));
  }
  if (x < width)
    out[x] = std::uint16_t (in[0] << kLow | (in[1] & kMask));
}

template <int kLow>
void
pack_triples (const std::uint16_t *in, std::uint8_t *out, int width)
{
  constexpr int kMask = (1 << kLow) - 1;
  int x = 0;
  for (; x + 1 < width; x += 2, out += 3) {
    out[0] = std::uint8_t (in[x] >> kLow);
    out[1] = std::uint8_t ((in[x] & kMask) | (in[x + 1] & kMask) << 4);
    out[2] = std::uint8_t (in[x + 1] >> kLow);
  }
  if (x < width) {
    out[0] = std::uint8_t (in[x] >> kLow);
    out[1] = std::uint8_t (in[x] & kMask);
  }
}

/* A stream of bits, lowest first; of 8 and 16 bits, little-endian words. */
template <int kBits>
void
unpack_stream (const std::uint8_t *in, std::uint16_t *out, int width)
{
  std::uint32_t held = 0;
  int bits = 0;
  for (int x = 0; x < width; x++) {
    for (; bits < kBits; bits += 8)
      held |= std::uint32_t (*in++) << bits;
    out[x] = std::uint16_t (held & ((1u << kBits) - 1));
    held >>= kBits;
    bits -= kBits;
  }
}

template <int kBits>
void
pack_stream (const std::uint16_t *in, std::uint8_t *out, int width)
{
  std::uint32_t held = 0;
  int bits = 0;
  for (int x = 0; x < width; x++) {
    held |= (std::uint32_t (in[x]) & ((1u << kBits) - 1)) << bits;
    for (bits += kBits; bits >= 8; bits -= 8, held >>= 8)
      *out++ = std::uint8_t (held);
  }
  if (bits > 0)
    *out = std::uint8_t (held);
}

struct Named {
  MonoFormat format;
  const char *name;
  int bits;
  int stored;
  void (*unpack) (const std::uint8_t *in, std::uint16_t *out, int width);
  void (*pack) (const std::uint16_t *in, std::uint8_t *out, int width);
};

template <int kBits>
constexpr Named
stream (MonoFormat format, const char *name, int bits)
{
  return {format, name, bits, kBits, unpack_stream<kBits>, pack_stream<kBits>};
}

template <int kLow>
constexpr Named
triples (MonoFormat format, const char *name)
{
  return {format, name, 8 + kLow, 12, unpack_triples<kLow>, pack_triples<kLow>};
}

constexpr std::array kFormats{
    stream<8> (MonoFormat::mono8, "Mono8", 8),
    stream<16> (MonoFormat::mono10, "Mono10", 10),
    stream<16> (MonoFormat::mono12, "Mono12", 12),
    stream<16> (MonoFormat::mono16, "Mono16", 16),
    triples<2> (MonoFormat::mono10_packed, "Mono10Packed"),
    triples<4> (MonoFormat::mono12_packed, "Mono12Packed"),
    stream<10> (MonoFormat::mono10p, "Mono10p", 10),
    stream<12> (MonoFormat::mono12p, "Mono12p", 12),
};

const Named &
named (MonoFormat format)
{
  return kFormats[std::size_t (format)];
}

Result<void>
check_rows (MonoFormat format, int bytes, int byte_rows, int width, int height)
{
  if (std::size_t (bytes) >= row_bytes (format, width) && byte_rows == height)
    return {};
  return Error{std::to_string (byte_rows) + " rows of " +
               std::to_string (bytes) + " bytes are not " +
               size_text ({width, height}) + " pixels of " +
               mono_format_text (format) + ", which take " +
               std::to_string (row_bytes (format, width)) + " a row"};
}

} // namespace

std::optional<MonoFormat>
parse_mono_format (std::string_view name)
{
  const auto same = [] (char a, char b) {
    return std::tolower (static_cast<unsigned char> (a)) ==
           std::tolower (static_cast<unsigned char> (b));
  };
  for (const Named &known : kFormats)
    if (std::ranges::equal (name, std::string_view (known.name), same))
      return known.format;
  return std::nullopt;
}

const char *
mono_format_text (MonoFormat format)
{
  return named (format).name;
}

int
significant_bits (MonoFormat format)
{
  return named (format).bits;
}

int
stored_bits (MonoFormat format)
{
  return named (format).stored;
}

std::size_t
row_bytes (MonoFormat format, int width)
{
  return (std::size_t (width) * std::size_t (stored_bits (format)) + 7) / 8;
}

Result<void>
unpack_mono (MonoFormat format, ImageView<const std::uint8_t> rows,
    ImageView<std::uint16_t> out)
{
  RETURN_IF_ERROR (
      check_rows (format, rows.width, rows.height, out.width, out.height));
  for (int y = 0; y < out.height; y++)
    named (format).unpack (rows.row (y), out.row (y), out.width);
  return {};
}

Result<void>
pack_mono (MonoFormat format, ImageView<const std::uint16_t> in,
    ImageView<std::uint8_t> rows)
{
  RETURN_IF_ERROR (
      check_rows (format, rows.width, rows.height, in.width, in.height));
  for (int y = 0; y < in.height; y++)
    named (format).pack (in.row (y), rows.row (y), in.width);
  return {};
}

} // namespace codedexposure

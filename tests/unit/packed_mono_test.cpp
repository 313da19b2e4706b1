/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Packed grey values: known bytes, the reference, and both directions. */
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "base/packed_mono.h"

using namespace codedexposure;

namespace
{

using Bytes = std::vector<std::uint8_t>;

constexpr MonoFormat kAll[] = {MonoFormat::mono8, MonoFormat::mono10,
    MonoFormat::mono12, MonoFormat::mono16, MonoFormat::mono10_packed,
    MonoFormat::mono12_packed, MonoFormat::mono10p, MonoFormat::mono12p};

ImageView<const std::uint8_t>
rows_of (const Bytes &bytes, int rows = 1)
{
  const int width = int (bytes.size ()) / rows;
  return {bytes.data (), width, rows, width};
}

std::vector<std::uint16_t>
unpacked (MonoFormat format, const Bytes &bytes, int width)
{
  std::vector<std::uint16_t> out (std::size_t (width), 0xFFFF);
  const auto done =
      unpack_mono (format, rows_of (bytes), {out.data (), width, 1, 2 * width});
  EXPECT_TRUE (done.ok ());
  return out;
}

/** One pixel of a packed row, bit by bit: what unpack_mono () must match. */
std::uint16_t
packed_pixel (MonoFormat format, const std::uint8_t *row, int x)
{
  const int bits = significant_bits (format);
  const bool triples = format == MonoFormat::mono10_packed ||
                       format == MonoFormat::mono12_packed;
  std::uint16_t value = 0;
  for (int bit = 0; bit < bits; bit++) {
    int at = x * stored_bits (format) + bit;
    if (triples) {
      const int low = bits - 8;
      const int first = x / 2 * 24;
      at = bit < low ? first + 8 + x % 2 * 4 + bit
                     : first + x % 2 * 16 + bit - low;
    }
    value = std::uint16_t (value | (row[at / 8] >> (at % 8) & 1) << bit);
  }
  return value;
}

} // namespace

TEST (PackedMono, KnownBytes)
{
  using Values = std::vector<std::uint16_t>;
  /* Pixels 0xABC and 0x123; 0x2AF and 0x155 of ten bits. */
  EXPECT_EQ (unpacked (MonoFormat::mono12_packed, {0xAB, 0x3C, 0x12}, 2),
      (Values{0xABC, 0x123}));
  EXPECT_EQ (unpacked (MonoFormat::mono12p, {0xBC, 0x3A, 0x12}, 2),
      (Values{0xABC, 0x123}));
  EXPECT_EQ (unpacked (MonoFormat::mono10_packed, {0xAB, 0x13, 0x55}, 2),
      (Values{0x2AF, 0x155}));
  EXPECT_EQ (unpacked (MonoFormat::mono10p, {0xAF, 0x56, 0x05}, 2),
      (Values{0x2AF, 0x155}));
  EXPECT_EQ (unpacked (MonoFormat::mono12, {0xBC, 0x0A, 0x23, 0x01}, 2),
      (Values{0xABC, 0x123}));
}

TEST (PackedMono, MatchesTheOracleAndComesBackForEveryWidth)
{
  std::mt19937 random (1);
  for (const MonoFormat format : kAll)
    for (int width = 1; width <= 33; width++) {
      SCOPED_TRACE (std::string (mono_format_text (format)) + " " +
                    std::to_string (width));
      const int stride = int (row_bytes (format, width)) + 3;
      constexpr int kRows = 3;
      Image<std::uint16_t> values (width, kRows);
      for (int y = 0; y < kRows; y++)
        for (int x = 0; x < width; x++)
          values.at (x, y) = std::uint16_t (
              random () & ((1u << significant_bits (format)) - 1));

      Bytes bytes (std::size_t (stride * kRows), 0xEE);
      const ImageView<std::uint8_t> rows{
          bytes.data (), stride - 3, kRows, stride};
      ASSERT_TRUE (pack_mono (format, values.view (), rows).ok ());
      for (int y = 0; y < kRows; y++)
        for (int pad = stride - 3; pad < stride; pad++)
          EXPECT_EQ (bytes[std::size_t (y * stride + pad)], 0xEE);

      Image<std::uint16_t> back (width, kRows);
      ASSERT_TRUE (unpack_mono (format, rows, back.view ()).ok ());
      for (int y = 0; y < kRows; y++)
        for (int x = 0; x < width; x++) {
          EXPECT_EQ (back.at (x, y), values.at (x, y));
          EXPECT_EQ (packed_pixel (format, rows.row (y), x), values.at (x, y));
        }
    }
}

TEST (PackedMono, TooShortRowsAreAnErrorThatNamesTheSizes)
{
  Image<std::uint16_t> out (8, 2);
  const Bytes bytes (2 * 11);
  const auto done =
      unpack_mono (MonoFormat::mono12p, rows_of (bytes, 2), out.view ());
  ASSERT_FALSE (done.ok ());
  EXPECT_NE (
      done.error ().message.find ("2 rows of 11 bytes"), std::string::npos);
  EXPECT_NE (done.error ().message.find ("12 a row"), std::string::npos);
}

TEST (PackedMono, NamesAreThoseOfGenicam)
{
  for (const MonoFormat format : kAll)
    EXPECT_EQ (parse_mono_format (mono_format_text (format)), format);
  EXPECT_EQ (parse_mono_format ("mono12packed"), MonoFormat::mono12_packed);
  EXPECT_EQ (parse_mono_format ("Mono14"), std::nullopt);
  EXPECT_EQ (parse_mono_format (""), std::nullopt);
}

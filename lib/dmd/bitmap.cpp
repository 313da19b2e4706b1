/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/bitmap.h"

namespace codedexposure
{

namespace
{

/** Bytes of a row, which are whole words of 32 bits. */
std::size_t
row_size (int width, int bits)
{
  return (std::size_t (width) * std::size_t (bits) + 31) / 32 * 4;
}

/** Everything in front of the pixels, but for the palette. */
Bytes
headers (int width, int height, int bits, std::uint32_t colours)
{
  constexpr std::uint32_t kFile = 14, kInfo = 40, kColour = 4;
  const auto pixels =
      std::uint32_t (row_size (width, bits) * std::size_t (height));
  const std::uint32_t start = kFile + kInfo + colours * kColour;
  constexpr int kLayers = 1, kNotCompressed = 0, kPixelsPerMetre = 0;
  Bytes file = bytes_of ({{'B', 1}, {'M', 1}, {start + pixels, 4}, {0, 4},
      {start, 4}, {kInfo, 4}, {width, 4}, {height, 4}, {kLayers, 2}, {bits, 2},
      {kNotCompressed, 4}, {pixels, 4}, {kPixelsPerMetre, 4},
      {kPixelsPerMetre, 4}, {colours, 4}, {0, 4}});
  file.reserve (start + pixels);
  return file;
}

} // namespace

void
append_bits (Bytes &bytes, const MirrorRows<std::uint8_t> &mirrors, int row,
    std::size_t size)
{
  const std::size_t start = bytes.size ();
  bytes.resize (start + size);
  const std::uint8_t *on = mirrors.row (row);
  for (int x = 0; x < mirrors.width (); x++)
    if (on[x] != 0)
      bytes[start + std::size_t (x / 8)] |= std::uint8_t (0x80 >> x % 8);
}

Bytes
encode_bitmap (const MirrorRows<std::uint8_t> &mirrors)
{
  Bytes file = headers (mirrors.width (), mirrors.height (), 1, 2);
  append (file, bytes_of ({{0x000000, 4}, {0xFFFFFF, 4}}));
  for (int y = mirrors.height () - 1; y >= 0; y--)
    append_bits (file, mirrors, y, row_size (mirrors.width (), 1));
  return file;
}

Bytes
encode_plane_bitmap (const MirrorRows<PlanePixel> &planes)
{
  Bytes file = headers (planes.width (), planes.height (), 24, 0);
  const std::size_t row_bytes = row_size (planes.width (), 24);
  for (int y = planes.height () - 1; y >= 0; y--) {
    const std::size_t start = file.size ();
    for (int x = 0; x < planes.width (); x++) {
      const PlanePixel pixel = planes.row (y)[x];
      // In the file: blue, green, red.
      file.push_back (std::uint8_t (pixel >> 16));
      file.push_back (std::uint8_t (pixel));
      file.push_back (std::uint8_t (pixel >> 8));
    }
    file.resize (start + row_bytes);
  }
  return file;
}

} // namespace codedexposure

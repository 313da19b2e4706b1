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
  Bytes file{'B', 'M'};
  file.reserve (start + pixels);
  append_le (file, start + pixels, 4);
  append_le (file, 0, 4);
  append_le (file, start, 4);
  append_le (file, kInfo, 4);
  append_le (file, std::uint32_t (width), 4);
  append_le (file, std::uint32_t (height), 4);
  append_le (file, 1, 2); // layers
  append_le (file, std::uint32_t (bits), 2);
  append_le (file, 0, 4); // not compressed
  append_le (file, pixels, 4);
  append_le (file, 0, 4); // pixels a metre, along x and y
  append_le (file, 0, 4);
  append_le (file, colours, 4);
  append_le (file, 0, 4);
  return file;
}

} // namespace

Bytes
encode_bitmap (const MirrorRows<std::uint8_t> &mirrors)
{
  Bytes file = headers (mirrors.width (), mirrors.height (), 1, 2);
  append_le (file, 0x000000, 4);
  append_le (file, 0xFFFFFF, 4);
  const std::size_t row_bytes = row_size (mirrors.width (), 1);
  for (int y = mirrors.height () - 1; y >= 0; y--) {
    const std::size_t start = file.size ();
    file.resize (start + row_bytes);
    for (int x = 0; x < mirrors.width (); x++)
      if (mirrors.row (y)[x] != 0)
        file[start + std::size_t (x / 8)] |= std::uint8_t (0x80 >> x % 8);
  }
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

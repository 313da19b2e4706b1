/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dlpc900_protocol.h"

#include <algorithm>
#include <array>

namespace codedexposure::dlpc900
{

namespace
{

constexpr std::size_t kHeaderSize = 48;
constexpr std::uint8_t kNotCompressed = 0;
constexpr std::uint8_t kEnhancedRunLength = 2;
/** Rows of plain images are padded to a multiple of this. */
constexpr std::size_t kRowPadding = 16;

/** By error code. */
constexpr const char *kErrors[] = {"", "batch file checksum", "device failure",
    "invalid command number", "controller and DMD do not belong together",
    "command not allowed in the current mode", "invalid parameter",
    "item not found", "out of resources", "invalid compression of an image",
    "bit position out of range", "image not in flash", "dark time out of range",
    "delay out of range", "exposure out of range",
    "pattern number out of range", "invalid pattern definition",
    "pattern memory address out of range"};

std::size_t
plain_row (int width)
{
  const std::size_t bytes = 3 * std::size_t (width);
  return (bytes + kRowPadding - 1) / kRowPadding * kRowPadding;
}

PiecedBytes
plain_pixels (const MirrorRows<PlanePixel> &image, int x, int width)
{
  PiecedBytes pixels;
  for (int i = 0; i < image.distinct.height (); i++) {
    Bytes &row = pixels.pieces.emplace_back ();
    append_pixels (row, image.distinct.view ().row (i) + x, width);
    row.resize (plain_row (width));
  }
  for (const int row : image.order)
    pixels.add (row);
  return pixels;
}

Bytes
image_header (Extent image, std::size_t size, std::uint8_t packing)
{
  Bytes header{'S', 'p', 'l', 'd'};
  append_le (header, std::uint32_t (image.width), 2);
  append_le (header, std::uint32_t (image.height), 2);
  append_le (header, std::uint32_t (size), 4);
  header.insert (header.end (), 8, 0xFF);
  append_le (header, 0, 4); // background colour
  append (header, std::array<std::uint8_t, 6>{1, packing, 1, 0, 0, 1});
  header.resize (kHeaderSize);
  return header;
}

} // namespace

Bytes
encode_entry (const Entry &entry)
{
  // One bit in white; the image is cleared after the exposure.
  constexpr unsigned kWhite = 7 << 4, kClear = 1;
  Bytes bytes;
  append_le (bytes, entry.index, 2);
  append_le (bytes, entry.time.exposure, 3);
  bytes.push_back (
      std::uint8_t (kClear | kWhite | unsigned (entry.wait_for_trigger) << 7));
  append_le (bytes, entry.time.dark, 3);
  bytes.push_back (entry.trigger_out_2 ? 0 : 1); // the bit disables
  append_le (bytes,
      std::uint32_t (entry.plane.image) | std::uint32_t (entry.plane.plane)
                                              << 11,
      2);
  return bytes;
}

Bytes
encode_configuration (int entries)
{
  Bytes bytes;
  append_le (bytes, std::uint32_t (entries), 2);
  append_le (bytes, 0, 4); // patterns until it stops: no limit
  return bytes;
}

Bytes
encode_order (const std::vector<int> &order)
{
  Bytes bytes = encode_configuration (int (order.size ()));
  for (const int entry : order)
    append_le (bytes, std::uint32_t (entry), 2);
  return bytes;
}

Bytes
encode_trigger_out (bool invert, int rising_us, int falling_us)
{
  Bytes bytes{std::uint8_t (invert)};
  append_le (bytes, std::uint32_t (rising_us), 2);
  append_le (bytes, std::uint32_t (falling_us), 2);
  return bytes;
}

Bytes
encode_trigger_in (int delay_us, bool falling)
{
  Bytes bytes;
  append_le (bytes, std::uint32_t (delay_us), 2);
  bytes.push_back (falling ? 1 : 0);
  return bytes;
}

PiecedBytes
encode_image (const MirrorRows<PlanePixel> &image, int x, int width)
{
  PiecedBytes code = encode_erle (image, x, width);
  std::uint8_t packing = kEnhancedRunLength;
  if (code.size > plain_row (width) * std::size_t (image.height ())) {
    code = plain_pixels (image, x, width);
    packing = kNotCompressed;
  }
  const std::size_t size = code.size;
  code.add (image_header ({width, image.height ()}, size, packing));
  std::rotate (code.order.begin (), code.order.end () - 1, code.order.end ());
  return code;
}

Bytes
encode_load (int index, std::size_t size)
{
  Bytes bytes;
  append_le (bytes, std::uint32_t (index), 2);
  append_le (bytes, std::uint32_t (size), 4);
  return bytes;
}

Bytes
encode_chunk (ByteView bytes)
{
  Bytes data;
  data.reserve (2 + bytes.size ());
  append_le (data, std::uint32_t (bytes.size ()), 2);
  append (data, bytes);
  return data;
}

std::size_t
image_packets (std::size_t size)
{
  const std::size_t rest = size % kImageChunk;
  return 1 + size / kImageChunk * hid_packets (kHidMessageSize) +
         (rest == 0 ? 0 : hid_packets (kChunkHead + rest));
}

std::string
error_text (std::uint8_t code)
{
  return code == 0xFF ? "internal error (error 255)"
                      : codedexposure::error_text (kErrors, code);
}

std::string
Version::text () const
{
  return std::to_string (major) + "." + std::to_string (minor) + "." +
         std::to_string (patch);
}

Version
parse_version (ByteView data)
{
  return {data[3], data[2], int (read_le (data, 0, 2))};
}

bool
needs_park_cycle (const Version &version)
{
  const auto is = [&] (int major, int minor) {
    return version.major == major && version.minor == minor;
  };
  return is (4, 1) || is (4, 2) || version == Version{5, 0, 0};
}

} // namespace codedexposure::dlpc900

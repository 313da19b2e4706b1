/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dlpc900_protocol.h"

#include <algorithm>

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
  constexpr std::uint32_t kUnused = 0xFFFFFFFF, kBlack = 0;
  Bytes header = bytes_of ({{'S', 1}, {'p', 1}, {'l', 1}, {'d', 1},
      {image.width, 2}, {image.height, 2}, {std::int64_t (size), 4},
      {kUnused, 4}, {kUnused, 4}, {kBlack, 4}, {1, 1}, {packing, 1}, {1, 1},
      {0, 2}, {1, 1}});
  header.resize (kHeaderSize);
  return header;
}

} // namespace

Bytes
encode_entry (const Entry &entry)
{
  // One bit in white; the image is cleared after the exposure.
  constexpr unsigned kWhite = 7 << 4, kClear = 1;
  return bytes_of ({{entry.index, 2}, {entry.time.exposure, 3},
      {kClear | kWhite | unsigned (entry.wait_for_trigger) << 7, 1},
      {entry.time.dark, 3}, {!entry.trigger_out_2, 1}, // the bit disables
      {entry.plane.image | entry.plane.plane << 11, 2}});
}

Bytes
encode_configuration (int entries)
{
  constexpr int kNoLimit = 0; // patterns until it stops
  return bytes_of ({{entries, 2}, {kNoLimit, 4}});
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
  return bytes_of ({{invert, 1}, {rising_us, 2}, {falling_us, 2}});
}

Bytes
encode_trigger_in (int delay_us, bool falling)
{
  return bytes_of ({{delay_us, 2}, {falling, 1}});
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
  return bytes_of ({{index, 2}, {std::int64_t (size), 4}});
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

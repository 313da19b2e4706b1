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

constexpr std::array<Board, 5> kBoards{{
    {1, "DLP6500", {1920, 1080}, 400, 105},
    {2, "DLP9000", {2560, 1600}, 480, 105},
    {3, "DLP670S", {2716, 1600}, 400, 105},
    {4, "DLP500YX", {2048, 1200}, 800, 62},
    {5, "DLP5500", {1024, 768}, 1024, 105},
}};

struct ErrorName {
  std::uint8_t code;
  const char *text;
};
constexpr std::array<ErrorName, 18> kErrors{{
    {1, "batch file checksum"},
    {2, "device failure"},
    {3, "invalid command number"},
    {4, "controller and DMD do not belong together"},
    {5, "command not allowed in the current mode"},
    {6, "invalid parameter"},
    {7, "item not found"},
    {8, "out of resources"},
    {9, "invalid compression of an image"},
    {10, "bit position out of range"},
    {11, "image not in flash"},
    {12, "dark time out of range"},
    {13, "delay out of range"},
    {14, "exposure out of range"},
    {15, "pattern number out of range"},
    {16, "invalid pattern definition"},
    {17, "pattern memory address out of range"},
    {255, "internal error"},
}};

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

Result<Board>
find_board (std::uint8_t type)
{
  for (const Board &board : kBoards)
    if (board.type == type)
      return board;
  return Error{"hardware type " + std::to_string (type) +
                   " is no DMD that is known here (1..5)",
      ErrorCode::device};
}

Bytes
encode_entry (const Entry &entry)
{
  constexpr unsigned kWhite = 7;
  Bytes bytes;
  append_le (bytes, entry.index, 2);
  append_le (bytes, entry.time.exposure, 3);
  bytes.push_back (std::uint8_t (unsigned (entry.clear_after) |
                                 unsigned (entry.bits - 1) << 1 | kWhite << 4 |
                                 unsigned (entry.wait_for_trigger) << 7));
  append_le (bytes, entry.time.dark, 3);
  bytes.push_back (entry.trigger_out_2 ? 0 : 1); // the bit disables
  append_le (bytes,
      std::uint32_t (entry.plane.image) | std::uint32_t (entry.plane.plane)
                                              << 11,
      2);
  return bytes;
}

Bytes
encode_configuration (int entries, std::uint32_t shown)
{
  Bytes bytes;
  append_le (bytes, std::uint32_t (entries), 2);
  append_le (bytes, shown, 4);
  return bytes;
}

Bytes
encode_order (const std::vector<int> &order, std::uint32_t shown)
{
  Bytes bytes = encode_configuration (int (order.size ()), shown);
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
encode_image (
    const MirrorRows<PlanePixel> &image, int x, int width, std::size_t unit)
{
  PiecedBytes code = encode_erle (image, x, width, unit);
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
  constexpr std::size_t kMessageHead = 8; // flags .. command, and the count
  const std::size_t rest = size % kImageChunk;
  const std::size_t tail =
      rest == 0 ? 0
                : (kMessageHead + rest + kHidPacketSize - 1) / kHidPacketSize;
  return 1 + size / kImageChunk * (kHidMessageSize / kHidPacketSize) + tail;
}

std::string
error_text (std::uint8_t code)
{
  for (const ErrorName &error : kErrors)
    if (error.code == code)
      return std::string (error.text) + " (error " + std::to_string (code) +
             ")";
  return "error " + std::to_string (code);
}

Result<std::vector<std::uint32_t>>
parse_minimum_exposures (ByteView data)
{
  constexpr std::size_t kDepths = 8;
  if (data.size () != 2 * kDepths && data.size () != 4 * kDepths)
    return Error{"the shortest exposures come in " +
                     std::to_string (data.size ()) + " bytes, not in 16 or 32",
        ErrorCode::device};
  std::vector<std::uint32_t> exposures;
  for (std::size_t depth = 0; depth < kDepths; depth++)
    exposures.push_back (read_le (data, 2 * depth, 2));
  if (exposures.front () == 0)
    return Error{
        "the device gives 0 as its shortest exposure", ErrorCode::device};
  return exposures;
}

std::string
Version::text () const
{
  return std::to_string (major) + "." + std::to_string (minor) + "." +
         std::to_string (patch);
}

Result<Version>
parse_version (ByteView data)
{
  constexpr std::size_t kSize = 16;
  if (data.size () != kSize)
    return Error{"the version comes in " + std::to_string (data.size ()) +
                     " bytes, not in " + std::to_string (kSize),
        ErrorCode::device};
  return Version{data[3], data[2], int (read_le (data, 0, 2))};
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

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Any bytes as packed rows: the pixels are packed to bytes that unpack to
 * them, and rows that are too short are refused. */
#include <vector>

#include "base/packed_mono.h"
#include "fuzz_check.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

void
check_rows (
    MonoFormat format, int width, int stride, std::vector<std::uint8_t> bytes)
{
  const int height = int (bytes.size ()) / stride;
  bytes.resize (std::size_t (height) * std::size_t (stride));
  if (height == 0)
    return;
  const ImageView<const std::uint8_t> rows{
      bytes.data (), stride, height, stride};
  Image<std::uint16_t> pixels (width, height), again (width, height);
  const auto unpacked = unpack_mono (format, rows, pixels.view ());
  check (unpacked);
  require (
      unpacked.ok () == (row_bytes (format, width) <= std::size_t (stride)),
      "a row of another size", mono_format_text (format));
  if (!unpacked)
    return;
  const Image<std::uint16_t> &read = pixels;
  std::vector<std::uint8_t> packed (bytes.size ());
  require (
      pack_mono (format, read.view (), {packed.data (), stride, height, stride})
              .ok () &&
          unpack_mono (
              format, {packed.data (), stride, height, stride}, again.view ())
              .ok (),
      "the pixels do not pack", mono_format_text (format));
  const bool packs = stored_bits (format) < 16;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      require (
          pixels.at (x, y) == again.at (x, y) &&
              (!packs || pixels.at (x, y) >> significant_bits (format) == 0),
          "another pixel", mono_format_text (format));
}

} // namespace

extern "C" int
LLVMFuzzerTestOneInput (const std::uint8_t *data, std::size_t size)
{
  if (size < 3)
    return 0;
  // The format, the width and the bytes of a row, at times too few.
  const auto format = MonoFormat (data[0] % 8);
  const int width = 1 + data[1];
  const int stride = 1 + data[2] * 2;
  check_rows (format, width, stride, {data + 3, data + size});
  return 0;
}

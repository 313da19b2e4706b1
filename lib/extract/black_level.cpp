/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/black_level.h"

#include <algorithm>
#include <limits>

#include "base/pixels.h"

namespace codedexposure
{

namespace
{

/* Where pixels are not widened, and blocks have a known length, the compiler
 * uses vectors. */
template <typename Pixel>
void
subtract (const Pixel *from, Pixel black, Pixel largest, int count, Pixel *to)
{
  for (int x = 0; x < count; x++) {
    const auto less = Pixel (std::max (from[x], black) - black);
    to[x] = from[x] >= largest ? from[x] : less;
  }
}

} // namespace

template <typename Pixel>
void
subtract_black (
    ImageView<const Pixel> frame, int black, int bits, ImageView<Pixel> light)
{
  constexpr int kBlock = 64;
  const auto largest = largest_pixel_of<Pixel> (bits);
  const auto least =
      Pixel (std::min (black, int (std::numeric_limits<Pixel>::max ())));
  for (int y = 0; y < frame.height; y++) {
    const Pixel *from = frame.row (y);
    Pixel *to = light.row (y);
    int x = 0;
    for (; x + kBlock <= frame.width; x += kBlock)
      subtract (from + x, least, largest, kBlock, to + x);
    subtract (from + x, least, largest, frame.width - x, to + x);
  }
}

template void subtract_black (
    ImageView<const std::uint8_t>, int, int, ImageView<std::uint8_t>);
template void subtract_black (
    ImageView<const std::uint16_t>, int, int, ImageView<std::uint16_t>);

} // namespace codedexposure

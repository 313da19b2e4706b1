/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/black_level.h"

#include <algorithm>

#include "base/pixels.h"

namespace codedexposure
{

template <typename Pixel>
void
subtract_black (
    ImageView<const Pixel> frame, int black, int bits, ImageView<Pixel> light)
{
  const int largest = largest_pixel_of<Pixel> (bits);
  for (int y = 0; y < frame.height; y++)
    std::transform (frame.row (y), frame.row (y) + frame.width, light.row (y),
        [=] (Pixel value) {
          return value >= largest ? value : Pixel (std::max (value - black, 0));
        });
}

template void subtract_black (
    ImageView<const std::uint8_t>, int, int, ImageView<std::uint8_t>);
template void subtract_black (
    ImageView<const std::uint16_t>, int, int, ImageView<std::uint16_t>);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/saturation.h"

#include <algorithm>

#include "base/pixels.h"
#include "extract/kernels.h"

namespace codedexposure
{

template <typename Pixel>
std::uint64_t
count_saturated (ImageView<const Pixel> frame, int bits)
{
  const auto largest = largest_pixel_of<Pixel> (bits);
  const auto targets = supported_targets ();
  std::uint64_t found = 0;
  for (int y = 0; y < frame.height; y++) {
    const Pixel *row = frame.row (y);
    found += targets.empty ()
                 ? std::uint64_t (std::count_if (row, row + frame.width,
                       [=] (Pixel pixel) { return pixel >= largest; }))
                 : targets.front ().kernels<Pixel> ().count (
                       row, frame.width, largest);
  }
  return found;
}

template std::uint64_t count_saturated (ImageView<const std::uint8_t>, int);
template std::uint64_t count_saturated (ImageView<const std::uint16_t>, int);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/saturation.h"

#include "extract/targets.h"

namespace codedexposure
{

template <typename Pixel>
std::uint64_t
count_saturated (ImageView<const Pixel> frame, int bits)
{
  const int all = 8 * int (sizeof (Pixel));
  const auto largest = Pixel ((1 << (bits > 0 && bits < all ? bits : all)) - 1);
  const Kernels<Pixel> &kernels =
      supported_targets ().front ().kernels<Pixel> ();
  std::uint64_t found = 0;
  for (int y = 0; y < frame.height; y++)
    found += kernels.count (frame.row (y), frame.width, largest);
  return found;
}

template std::uint64_t count_saturated (ImageView<const std::uint8_t>, int);
template std::uint64_t count_saturated (ImageView<const std::uint16_t>, int);

} // namespace codedexposure

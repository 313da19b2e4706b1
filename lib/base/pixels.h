/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Values of pixels. */
#pragma once

#include <limits>

namespace codedexposure
{

/** The largest value of pixels with @p bits significant bits. */
constexpr int
largest_pixel (int bits)
{
  return (1 << bits) - 1;
}

/** The significant bits of a Pixel; @p bits 0, or more than it has: all. */
template <typename Pixel>
constexpr int
significant_bits_of (int bits)
{
  constexpr int kAll = std::numeric_limits<Pixel>::digits;
  return bits > 0 && bits < kAll ? bits : kAll;
}

/** The largest value of a Pixel with so many significant bits. */
template <typename Pixel>
constexpr Pixel
largest_pixel_of (int bits)
{
  return Pixel (largest_pixel (significant_bits_of<Pixel> (bits)));
}

} // namespace codedexposure

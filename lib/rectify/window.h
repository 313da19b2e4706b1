/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Sums over the pixels of a window; for this folder only. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "rectify/filters.h"

namespace codedexposure
{

/* Explicit vectors, as the compiler does not vectorise plain loops here. */
typedef float Four __attribute__ ((vector_size (16)));

/** Eight pixels. */
struct Eight {
  Four low, high;
};

typedef std::uint8_t Bytes __attribute__ ((vector_size (8)));
typedef std::uint16_t Words __attribute__ ((vector_size (16)));

inline Eight
to_floats (Words n)
{
  typedef std::int32_t Ints __attribute__ ((vector_size (16)));
  return {__builtin_convertvector(
              __builtin_convertvector(
                  __builtin_shufflevector (n, n, 0, 1, 2, 3), Ints),
              Four),
      __builtin_convertvector(
          __builtin_convertvector(
              __builtin_shufflevector (n, n, 4, 5, 6, 7), Ints),
          Four)};
}

inline Eight
load_eight (const std::uint16_t *from)
{
  Words n;
  std::memcpy (&n, from, sizeof n);
  return to_floats (n);
}

inline Eight
load_eight (const std::uint8_t *from)
{
  Bytes n;
  std::memcpy (&n, from, sizeof n);
  return to_floats (__builtin_convertvector(n, Words));
}

inline Four
load_four (const float *from)
{
  Four four;
  std::memcpy (&four, from, sizeof four);
  return four;
}

inline float
sum_of (Four v)
{
  return (v[0] + v[1]) + (v[2] + v[3]);
}

/** kTaps x kTaps pixels of a frame; kRead pixels of each row can be read. */
template <int kTaps, typename Pixel>
struct Window {
  static constexpr int kLength = FilterBank::row_length (kTaps);
  static constexpr int kRead = 16;

  const Pixel *first;
  std::ptrdiff_t stride; ///< bytes

  const Pixel *row (int y) const
  {
    return reinterpret_cast<const Pixel *> (
        reinterpret_cast<const std::byte *> (first) + y * stride);
  }

  /** Mean squared difference of neighbours among the central 5 x 5 pixels. */
  float roughness () const
  {
    constexpr int kFirst = kTaps / 2 - 2, kSteps = 4;
    Four across = {}, down = {};
    Four here = load_eight (row (kFirst) + kFirst).low;
    for (int y = kFirst; y < kFirst + kSteps; y++) {
      const Four below = load_eight (row (y + 1) + kFirst).low;
      const Four right = load_eight (row (y) + kFirst + 1).low;
      across += (right - here) * (right - here);
      down += (below - here) * (below - here);
      here = below;
    }
    return sum_of (across + down) / (2 * kSteps * kSteps);
  }

  /** @p weights  from FilterBank::weights (). */
  float filtered (const float *weights) const
  {
    Four low = {}, high = {};
    for (int y = 0; y < kTaps; y++, weights += kLength)
      for (int x = 0; x < kLength; x += 8) {
        const Eight pixels = load_eight (row (y) + x);
        low += load_four (weights + x) * pixels.low;
        if (x + 4 < kLength)
          high += load_four (weights + x + 4) * pixels.high;
      }
    return sum_of (low + high);
  }
};

} // namespace codedexposure

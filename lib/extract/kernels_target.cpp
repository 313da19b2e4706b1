/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of one instruction set, compiled once for each. */
#include "base/vector.h"
#include "extract/decode_kernel.h"
#include "extract/kernels.h"
#include "extract/select.h"
#include "extract/sort.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/** Kernels::count. */
template <typename T>
std::uint64_t
count (const T *row, int pixels, T largest)
{
  /* So many that a number of their own type counts them. */
  constexpr int kPart = 128;
  std::uint64_t found = 0;
  for (int x = 0; x < pixels; x += kPart) {
    const int end = pixels - x < kPart ? pixels : x + kPart;
    T hits = 0;
    for (int i = x; i < end; i++)
      hits = T (hits + (row[i] >= largest));
    found += hits;
  }
  return found;
}

template <typename T>
constexpr Kernels<T> kKernels = {
    kLanes<T>, select<T>, rank<T>, decode<T>, decode_row<T>, count<T>};

extern const Target kernels;
const Target kernels = {
    CODEDEXPOSURE_TARGET_NAME, kKernels<std::uint8_t>, kKernels<std::uint16_t>};

} // namespace codedexposure::CODEDEXPOSURE_TARGET

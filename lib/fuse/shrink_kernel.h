/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Hard thresholding of transformed blocks, a block to a lane. */
#pragma once

#include "extract/vector.h"
#include "fuse/dct.h"
#include "fuse/filter_kernel.h"

namespace cexp::CEXP_TARGET
{

using Ints = Vector<std::int32_t>;
constexpr int kArea = fuse::kBlock * fuse::kBlock;

/* Orthonormal DCT-II of 12 values that lie @p step apart, in place; the even
 * and the odd half of the output need only sums and differences. */
CEXP_INLINE void
dct (float *values, std::ptrdiff_t step)
{
  constexpr int kHalf = fuse::kBlock / 2;
  Floats sum[kHalf], difference[kHalf];
#pragma GCC unroll 6
  for (int i = 0; i < kHalf; i++) {
    const Floats a = load (values + i * step);
    const Floats b = load (values + (fuse::kBlock - 1 - i) * step);
    sum[i] = a + b;
    difference[i] = a - b;
  }
#pragma GCC unroll 6
  for (int k = 0; k < kHalf; k++) {
    Floats even = {}, odd = {};
#pragma GCC unroll 6
    for (int i = 0; i < kHalf; i++) {
      even += fuse::kDct.at[2 * k][i] * sum[i];
      odd += fuse::kDct.at[2 * k + 1][i] * difference[i];
    }
    store (values + 2 * k * step, even);
    store (values + (2 * k + 1) * step, odd);
  }
}

/* The inverse of dct (). */
CEXP_INLINE void
undo_dct (float *values, std::ptrdiff_t step)
{
  constexpr int kHalf = fuse::kBlock / 2;
  Floats in[fuse::kBlock];
#pragma GCC unroll 12
  for (int k = 0; k < fuse::kBlock; k++)
    in[k] = load (values + k * step);
#pragma GCC unroll 6
  for (int i = 0; i < kHalf; i++) {
    Floats even = {}, odd = {};
#pragma GCC unroll 6
    for (int k = 0; k < kHalf; k++) {
      even += fuse::kDct.at[2 * k][i] * in[2 * k];
      odd += fuse::kDct.at[2 * k + 1][i] * in[2 * k + 1];
    }
    store (values + i * step, even + odd);
    store (values + (fuse::kBlock - 1 - i) * step, even - odd);
  }
}

/* values[k] = sum over s of the transform's [k][s], or [s][k], times values[s],
 * which lie @p step apart. */
template <bool Back>
CEXP_INLINE void
transform_slots (
    float *values, std::ptrdiff_t step, const float *transform, int slots)
{
  constexpr int kMost = 16;
  Floats in[kMost];
  for (int s = 0; s < slots; s++)
    in[s] = load (values + s * step);
  for (int k = 0; k < slots; k++) {
    Floats sum = {};
    for (int s = 0; s < slots; s++)
      sum += transform[Back ? s * slots + k : k * slots + s] * in[s];
    store (values + k * step, sum);
  }
}

/* Where column @p x of the blocks begins. */
CEXP_INLINE std::ptrdiff_t
column (const fuse::ShrinkRow &row, int x)
{
  return ((x + row.shift) % fuse::kBlockStep) * row.split +
         (x + row.shift) / fuse::kBlockStep;
}

CEXP_INLINE void
shrink_vector (const fuse::ShrinkRow &row, int first)
{
  constexpr std::ptrdiff_t kRow = std::ptrdiff_t (fuse::kBlock) * kFloats;
  constexpr std::ptrdiff_t kSlot = std::ptrdiff_t (kArea) * kFloats;
  float *const block = row.scratch;

  for (int s = 0; s < row.slots; s++) {
    float *plane = block + s * kSlot;
    for (int y = 0; y < fuse::kBlock; y++) {
      for (int x = 0; x < fuse::kBlock; x++)
        store (plane + y * kRow + x * kFloats,
            load (row.source[s] + y * row.stride + column (row, x) + first));
      dct (plane + y * kRow, kFloats);
    }
    for (int x = 0; x < fuse::kBlock; x++)
      dct (plane + x * kFloats, kRow);
  }

  Ints kept = {};
  const Floats threshold = Floats{} + row.threshold;
  for (int i = 0; i < kArea; i++) {
    float *values = block + i * kFloats;
    transform_slots<false> (values, kSlot, row.slot_transform, row.slots);
    for (int s = 0; s < row.slots; s++) {
      const Floats value = load (values + s * kSlot);
      const Ints keep = (value > threshold) | (value < -threshold) |
                        (Ints{} - int (i == 0 && s == 0));
      kept -= keep;
      store (values + s * kSlot, (Floats)((Ints)value & keep));
    }
    transform_slots<true> (values, kSlot, row.slot_transform, row.slots);
  }

  const Floats weight = 1.0f / __builtin_convertvector(kept, Floats);
  for (int s = 0; s < row.slots; s++) {
    float *plane = block + s * kSlot;
    for (int x = 0; x < fuse::kBlock; x++)
      undo_dct (plane + x * kFloats, kRow);
    for (int y = 0; y < fuse::kBlock; y++) {
      undo_dct (plane + y * kRow, kFloats);
      for (int x = 0; x < fuse::kBlock; x++) {
        float *to = row.sum[s] + y * row.stride + column (row, x) + first;
        store (to, load (to) + weight * load (plane + y * kRow + x * kFloats));
      }
    }
  }
  for (int y = 0; y < fuse::kBlock; y++) {
    for (int x = 0; x < fuse::kBlock; x++) {
      float *to = row.weight + y * row.stride + column (row, x) + first;
      store (to, load (to) + weight);
    }
  }
}

/* From the last to the first: a pixel then gets what its blocks have in the
 * same order, whatever the width of vectors. */
inline void
shrink (const fuse::ShrinkRow &row)
{
  for (int first = row.blocks - kFloats; first >= 0; first -= kFloats)
    shrink_vector (row, first);
}

} // namespace cexp::CEXP_TARGET

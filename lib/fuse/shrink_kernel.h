/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Hard thresholding of transformed blocks, one block per lane. */
#pragma once

#include "base/vector.h"
#include "fuse/dct.h"
#include "fuse/filter_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

constexpr int kArea = fuse::kBlock * fuse::kBlock;

/* Orthonormal DCT-II of 12 values. The even half of the output needs only sums,
 * the odd half only differences. */
CODEDEXPOSURE_INLINE void
dct (Floats *values)
{
  constexpr int kHalf = fuse::kBlock / 2;
  Floats sum[kHalf], difference[kHalf];
#pragma GCC unroll 6
  for (int i = 0; i < kHalf; i++) {
    const Floats a = values[i], b = values[fuse::kBlock - 1 - i];
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
    values[2 * k] = even;
    values[2 * k + 1] = odd;
  }
}

/* The inverse of dct (). */
CODEDEXPOSURE_INLINE void
undo_dct (Floats *values)
{
  constexpr int kHalf = fuse::kBlock / 2;
  Floats in[fuse::kBlock];
#pragma GCC unroll 12
  for (int k = 0; k < fuse::kBlock; k++)
    in[k] = values[k];
#pragma GCC unroll 6
  for (int i = 0; i < kHalf; i++) {
    Floats even = {}, odd = {};
#pragma GCC unroll 6
    for (int k = 0; k < kHalf; k++) {
      even += fuse::kDct.at[2 * k][i] * in[2 * k];
      odd += fuse::kDct.at[2 * k + 1][i] * in[2 * k + 1];
    }
    values[i] = even + odd;
    values[fuse::kBlock - 1 - i] = even - odd;
  }
}

/* 12 values, @p step apart. */
CODEDEXPOSURE_INLINE void
load_line (const float *from, std::ptrdiff_t step, Floats *values)
{
#pragma GCC unroll 12
  for (int i = 0; i < fuse::kBlock; i++)
    values[i] = load (from + i * step);
}
CODEDEXPOSURE_INLINE void
store_line (float *to, std::ptrdiff_t step, const Floats *values)
{
#pragma GCC unroll 12
  for (int i = 0; i < fuse::kBlock; i++)
    store (to + i * step, values[i]);
}

/* out (k) = sum over s of the transform's [k][s], or [s][k], times in (s).
 * Slots: their number if it is known at compile time, else 0. */
template <bool Back, int Slots, typename In, typename Out>
CODEDEXPOSURE_INLINE void
transform_slots (const fuse::ShrinkRow &row, In in, Out out)
{
  constexpr int kMaxSlots = Slots ? Slots : 16;
  const int slots = Slots ? Slots : row.slots;
  Floats values[kMaxSlots];
  for (int s = 0; s < slots; s++)
    values[s] = in (s);
  for (int k = 0; k < slots; k++) {
    Floats sum = {};
    for (int s = 0; s < slots; s++)
      sum +=
          row.slot_transform[Back ? s * slots + k : k * slots + s] * values[s];
    out (k, sum);
  }
}

/* Where column @p x of the blocks begins. */
CODEDEXPOSURE_INLINE std::ptrdiff_t
column (const fuse::ShrinkRow &row, int x)
{
  return ((x + row.shift) % fuse::kBlockStep) * row.split +
         (x + row.shift) / fuse::kBlockStep;
}

constexpr std::ptrdiff_t kRow = std::ptrdiff_t (fuse::kBlock) * kFloats;
constexpr std::ptrdiff_t kPlane = std::ptrdiff_t (kArea) * kFloats;

/* Shrinks a plane of the transform over slots; returns minus the number of
 * coefficients that are kept. Keep: the first coefficient is always kept. */
template <bool Keep>
CODEDEXPOSURE_INLINE Ints
shrink_plane (float *plane, Floats threshold)
{
  Floats line[fuse::kBlock];
  for (int y = 0; y < fuse::kBlock; y++) {
    load_line (plane + y * kRow, kFloats, line);
    dct (line);
    store_line (plane + y * kRow, kFloats, line);
  }
  Ints kept = {};
  for (int x = 0; x < fuse::kBlock; x++) {
    load_line (plane + x * kFloats, kRow, line);
    dct (line);
#pragma GCC unroll 12
    for (int y = 0; y < fuse::kBlock; y++) {
      const Ints keep = (line[y] > threshold) | (line[y] < -threshold) |
                        (Ints{} - int (Keep && x == 0 && y == 0));
      kept += keep;
      line[y] = (Floats)((Ints)line[y] & keep);
    }
    undo_dct (line);
    store_line (plane + x * kFloats, kRow, line);
  }
  for (int y = 0; y < fuse::kBlock; y++) {
    load_line (plane + y * kRow, kFloats, line);
    undo_dct (line);
    store_line (plane + y * kRow, kFloats, line);
  }
  return kept;
}

/* Slots are transformed first: each plane of their transform is then shrunk on
 * its own and fits into the first-level cache. */
template <int Slots>
CODEDEXPOSURE_INLINE void
shrink_vector (const fuse::ShrinkRow &row, int first)
{
  float *const block = row.scratch;
  for (int y = 0; y < fuse::kBlock; y++) {
    for (int x = 0; x < fuse::kBlock; x++) {
      const std::ptrdiff_t at = y * row.stride + column (row, x) + first;
      float *to = block + y * kRow + x * kFloats;
      transform_slots<false, Slots> (
          row,
          [&] (int s)
              CODEDEXPOSURE_INLINE_BODY { return load (row.source[s] + at); },
          [&] (int k, Floats value)
              CODEDEXPOSURE_INLINE_BODY { store (to + k * kPlane, value); });
    }
  }

  const Floats threshold = Floats{} + row.threshold;
  Ints kept = shrink_plane<true> (block, threshold);
  for (int k = 1; k < row.slots; k++)
    kept += shrink_plane<false> (block + k * kPlane, threshold);

  const Floats weight = -1.0f / __builtin_convertvector(kept, Floats);
  for (int y = 0; y < fuse::kBlock; y++) {
    for (int x = 0; x < fuse::kBlock; x++) {
      const std::ptrdiff_t at = y * row.stride + column (row, x) + first;
      const float *from = block + y * kRow + x * kFloats;
      transform_slots<true, Slots> (
          row,
          [&] (int k)
              CODEDEXPOSURE_INLINE_BODY { return load (from + k * kPlane); },
          [&] (int s, Floats value) CODEDEXPOSURE_INLINE_BODY {
            float *to = row.sum[s] + at;
            store (to, load (to) + weight * value);
          });
      float *to = row.weight + at;
      store (to, load (to) + weight);
    }
  }
}

template <int Slots>
CODEDEXPOSURE_INLINE void
shrink_all (const fuse::ShrinkRow &row)
{
  for (int first = row.blocks - kFloats; first >= 0; first -= kFloats)
    shrink_vector<Slots> (row, first);
}

/* From the last block to the first: every vector width then adds the blocks of
 * a pixel in the same order. */
inline void
shrink (const fuse::ShrinkRow &row)
{
  if (row.slots == 4)
    shrink_all<4> (row);
  else if (row.slots == 8)
    shrink_all<8> (row);
  else
    shrink_all<0> (row);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

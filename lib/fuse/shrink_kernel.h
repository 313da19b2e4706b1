/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Hard thresholding of transformed blocks, one block per lane. */
#pragma once

#include "base/vector.h"
#include "fuse/dct.h"
#include "fuse/filter_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

constexpr int kArea = fuse::kBlock * fuse::kBlock;

/* Orthonormal DCT-II of 12 values. Even frequencies need only sums of the first
 * value and the last one and so on, odd ones only differences; among the even
 * ones it is so again. Of the rest, frequencies 3 and 9 have two factors. */
CODEDEXPOSURE_INLINE void
dct (Floats *x)
{
  constexpr int kHalf = fuse::kBlock / 2;
  const auto &f = fuse::kDct.at;
  Floats s[kHalf], d[kHalf];
#pragma GCC unroll 6
  for (int i = 0; i < kHalf; i++) {
    s[i] = x[i] + x[fuse::kBlock - 1 - i];
    d[i] = x[i] - x[fuse::kBlock - 1 - i];
  }
  const Floats p0 = s[0] + s[5], p1 = s[1] + s[4], p2 = s[2] + s[3];
  const Floats q0 = s[0] - s[5], q1 = s[1] - s[4], q2 = s[2] - s[3];
  const Floats ends = p0 + p2, middle = f[2][1] * q1;
  x[0] = f[0][0] * (ends + p1);
  x[4] = f[4][0] * (p0 - p2);
  x[8] = f[8][0] * ends + f[8][1] * p1;
  x[2] = f[2][0] * q0 + f[2][2] * q2 + middle;
  x[6] = f[6][0] * (q0 - q1 - q2);
  x[10] = f[2][2] * q0 + f[2][0] * q2 - middle;
  const Floats u = d[0] - d[3] - d[4], v = d[1] - d[2] - d[5];
  x[3] = f[3][0] * u + f[3][1] * v;
  x[9] = f[9][0] * u + f[9][1] * v;
#pragma GCC unroll 4
  for (const int k : {1, 5, 7, 11}) {
    Floats sum = f[k][0] * d[0];
#pragma GCC unroll 5
    for (int i = 1; i < kHalf; i++)
      sum += f[k][i] * d[i];
    x[k] = sum;
  }
}

/* The inverse of dct (). */
CODEDEXPOSURE_INLINE void
undo_dct (Floats *x)
{
  constexpr int kHalf = fuse::kBlock / 2;
  const auto &f = fuse::kDct.at;
  const Floats mean = f[0][0] * x[0], fourth = f[4][0] * x[4];
  const Floats ends = mean + f[8][0] * x[8], sixth = f[6][0] * x[6];
  const Floats p[] = {ends + fourth, mean + f[8][1] * x[8], ends - fourth};
  const Floats q[] = {f[2][0] * x[2] + f[2][2] * x[10] + sixth,
      f[2][1] * (x[2] - x[10]) - sixth,
      f[2][2] * x[2] + f[2][0] * x[10] - sixth};
  const Floats u = f[3][0] * x[3] + f[9][0] * x[9];
  const Floats v = f[3][1] * x[3] + f[9][1] * x[9];
  const Floats few[] = {u, v, -v, -u, -u, -v};
  Floats out[fuse::kBlock];
#pragma GCC unroll 6
  for (int i = 0; i < kHalf; i++) {
    const int near = i < 3 ? i : kHalf - 1 - i;
    const Floats even = i < 3 ? p[near] + q[near] : p[near] - q[near];
    const Floats odd = f[1][i] * x[1] + f[5][i] * x[5] + f[7][i] * x[7] +
                       f[11][i] * x[11] + few[i];
    out[i] = even + odd;
    out[fuse::kBlock - 1 - i] = even - odd;
  }
#pragma GCC unroll 12
  for (int i = 0; i < fuse::kBlock; i++)
    x[i] = out[i];
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

/* The cosine transform of slots: out (k) = sum over s of [k][s] * in (s), by
 * the sums and differences of the first slot and the last one and so on. Slots:
 * their number if it is known at compile time, else 0. */
template <int Slots, typename In, typename Out>
CODEDEXPOSURE_INLINE void
transform_slots (const fuse::ShrinkRow &row, In in, Out out)
{
  const int slots = Slots ? Slots : row.slots, half = slots / 2;
  Floats sum[(Slots ? Slots : 16) / 2], difference[(Slots ? Slots : 16) / 2];
  for (int s = 0; s < half; s++) {
    const Floats a = in (s), b = in (slots - 1 - s);
    sum[s] = a + b;
    difference[s] = a - b;
  }
  for (int k = 0; k < slots; k++) {
    const float *factors = row.slot_transform + k * slots;
    Floats value = slots % 2 ? factors[half] * in (half) : Floats{};
    for (int s = 0; s < half; s++)
      value += factors[s] * (k % 2 ? difference[s] : sum[s]);
    out (k, value);
  }
}

/* Its inverse. */
template <int Slots, typename In, typename Out>
CODEDEXPOSURE_INLINE void
undo_transform_slots (const fuse::ShrinkRow &row, In in, Out out)
{
  const int slots = Slots ? Slots : row.slots;
  Floats values[Slots ? Slots : 16];
  for (int k = 0; k < slots; k++)
    values[k] = in (k);
  for (int s = 0; s < (slots + 1) / 2; s++) {
    Floats even = {}, odd = {};
    for (int k = 0; k < slots; k++)
      (k % 2 ? odd : even) += row.slot_transform[k * slots + s] * values[k];
    out (s, even + odd);
    if (s != slots - 1 - s)
      out (slots - 1 - s, even - odd);
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
      transform_slots<Slots> (
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
      undo_transform_slots<Slots> (
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

/* Bytes as whole numbers. */
CODEDEXPOSURE_INLINE Ints
load_bytes (const std::uint8_t *from)
{
  typedef std::uint8_t Bytes __attribute__ ((vector_size (kFloats)));
  Bytes bytes;
  __builtin_memcpy (&bytes, from, kFloats);
  return __builtin_convertvector(bytes, Ints);
}

inline void
settle (const fuse::SettleRow &row)
{
  for (int x = 0; x < row.count; x += kFloats) {
    const Floats weight = load (row.weight + x);
    const Floats inverse = 1.0f / weight;
    const Floats coded = load (row.coded + x);
    const Ints measured = load_bytes (row.measured + x);
    for (int s = 0; s < row.slots; s++) {
      const Floats light = load (row.light[s] + x);
      const Floats mean =
          light + row.step * (load (row.sum[s] + x) * inverse - light);
      const Floats settled = weight > 0.0f ? mean : light;
      store (row.light[s] + x, measured == s ? coded : settled);
      store (row.sum[s] + x, Floats{});
    }
    store (row.weight + x, Floats{});
  }
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One row of a 3x3 convolution, the outputs of a pixel in lanes. */
#pragma once

#include "fuse/filter_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/* As many values of 16 bits as a vector has sums. */
typedef std::int16_t Shorts __attribute__ ((vector_size (kVectorBytes / 2)));

/* Pixels x .. x + Pixels - 1; Vectors: of the outputs of a pixel. */
template <int Vectors, int Pixels>
CODEDEXPOSURE_INLINE void
sum_pixels (const fuse::ConvolveRow &row, int x, Ints (&sum)[Pixels][Vectors])
{
  for (int p = 0; p < Pixels; p++)
#pragma GCC unroll 8
    for (int v = 0; v < Vectors; v++)
      sum[p][v] = load (row.bias + v * kFloats);
  const std::int16_t *weights = row.weights;
  for (int r = 0; r < 3; r++) {
    /* The values of the pixels at x - 1, x and x + 1 are one after the other.
     */
    const std::int16_t *from = row.source[r] + x * row.inputs;
    for (int i = 0; i < 3 * row.inputs; i += 2) {
      Ints weight[Vectors];
#pragma GCC unroll 8
      for (int v = 0; v < Vectors; v++, weights += 2 * kFloats)
        weight[v] = Ints (load (weights));
#pragma GCC unroll 16
      for (int p = 0; p < Pixels; p++) {
        std::int32_t pair;
        __builtin_memcpy (&pair, from + p * row.inputs + i, sizeof pair);
#pragma GCC unroll 8
        for (int v = 0; v < Vectors; v++)
          sum[p][v] = add_product (sum[p][v], weight[v], Ints{} + pair);
      }
    }
  }
}

/* The results of a vector of sums at @at, which has the outputs from k on. */
CODEDEXPOSURE_INLINE void
finish_sums (const fuse::ConvolveRow &row, Ints sum, int at, int k)
{
  const Floats value =
      load (row.scale + k) * __builtin_convertvector(sum, Floats);
  if (!row.hidden) {
    store (row.to + at, value);
    return;
  }
  Ints steps = __builtin_convertvector(
      smaller (larger (value + 0.5f, Floats{}), Floats{} + 32767.0f), Ints);
  if (row.add) {
    Shorts add;
    __builtin_memcpy (&add, row.add + at, sizeof add);
    steps =
        smaller (steps + __builtin_convertvector(add, Ints), Ints{} + 32767);
  }
  const Shorts result = __builtin_convertvector(steps, Shorts);
  __builtin_memcpy (row.hidden + at, &result, sizeof result);
}

template <int Vectors, int Pixels>
CODEDEXPOSURE_INLINE void
convolve_pixels (const fuse::ConvolveRow &row, int x)
{
  Ints sum[Pixels][Vectors];
  sum_pixels<Vectors, Pixels> (row, x, sum);
  for (int p = 0; p < Pixels; p++)
#pragma GCC unroll 8
    for (int v = 0; v < Vectors; v++)
      finish_sums (
          row, sum[p][v], ((x + p) * Vectors + v) * kFloats, v * kFloats);
}

/* Registers hold the sums of some pixels, so that each weight is read once for
 * them. The last ones of a row may be computed twice, which takes less time
 * than one by one. */
template <int Vectors>
CODEDEXPOSURE_INLINE void
convolve_outputs (const fuse::ConvolveRow &row)
{
#if CODEDEXPOSURE_VECTOR_BYTES == 64 || defined __aarch64__
  constexpr int kSums = 16;
#else
  constexpr int kSums = 8;
#endif
  constexpr int kPixels = kSums / Vectors;
  const int last = row.pixels - kPixels;
  if (last < 0)
    for (int x = 0; x < row.pixels; x++)
      convolve_pixels<Vectors, 1> (row, x);
  else
    for (int x = 0; x < row.pixels; x += kPixels)
      convolve_pixels<Vectors, kPixels> (row, x < last ? x : last);
}

inline void
convolve (const fuse::ConvolveRow &row)
{
  if (row.outputs == 2 * fuse::kConvolveLanes)
    convolve_outputs<2 * fuse::kConvolveLanes / kFloats> (row);
  else
    convolve_outputs<fuse::kConvolveLanes / kFloats> (row);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

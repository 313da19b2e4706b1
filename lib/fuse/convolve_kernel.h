/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One row of a 3x3 convolution, the channels of a pixel in lanes. */
#pragma once

#include "fuse/filter_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/* a * b + sum, rounded once, which takes half the time of rounding twice. Where
 * the processor cannot, the library computes it value by value. */
CODEDEXPOSURE_INLINE Floats
fused (Floats a, Floats b, Floats sum)
{
#if CODEDEXPOSURE_VECTOR_BYTES == 64
  return Floats (_mm512_fmadd_ps (__m512 (a), __m512 (b), __m512 (sum)));
#elif defined __FMA__
  return Floats (_mm256_fmadd_ps (__m256 (a), __m256 (b), __m256 (sum)));
#else
  for (int i = 0; i < kFloats; i++)
    sum[i] = __builtin_fmaf (a[i], b[i], sum[i]);
  return sum;
#endif
}

/* Vectors: of the outputs of a pixel. */
template <int Vectors, int Pixels>
CODEDEXPOSURE_INLINE void
convolve_pixels (const fuse::ConvolveRow &row, int x)
{
  constexpr int kOutputs = Vectors * kFloats;
  Floats sum[Pixels][Vectors];
  for (int p = 0; p < Pixels; p++)
#pragma GCC unroll 8
    for (int v = 0; v < Vectors; v++)
      sum[p][v] = load (row.bias + v * kFloats);
  const float *weights = row.weights;
  for (int tap = 0; tap < 9; tap++) {
    const float *from = row.source[tap / 3] + (x + tap % 3) * row.inputs;
    for (int i = 0; i < row.inputs; i++, weights += kOutputs) {
#pragma GCC unroll 16
      for (int p = 0; p < Pixels; p++) {
        const Floats value = Floats{} + from[p * row.inputs + i];
#pragma GCC unroll 8
        for (int v = 0; v < Vectors; v++)
          sum[p][v] = fused (load (weights + v * kFloats), value, sum[p][v]);
      }
    }
  }
  for (int p = 0; p < Pixels; p++) {
    float *to = row.to + (x + p) * kOutputs;
#pragma GCC unroll 8
    for (int v = 0; v < Vectors; v++) {
      Floats value = sum[p][v];
      if (row.hidden)
        value = larger (value, Floats{});
      if (row.add)
        value += load (row.add + (x + p) * kOutputs + v * kFloats);
      store (to + v * kFloats, value);
    }
  }
}

/* Registers hold the sums of some pixels, so that each weight is read once for
 * them. */
template <int Vectors>
CODEDEXPOSURE_INLINE void
convolve_outputs (const fuse::ConvolveRow &row)
{
  constexpr int kSums = kVectorBytes == 64 ? 16 : 8;
  constexpr int kPixels = kSums > Vectors ? kSums / Vectors : 1;
  int x = 0;
  for (; x + kPixels <= row.pixels; x += kPixels)
    convolve_pixels<Vectors, kPixels> (row, x);
  for (; x < row.pixels; x++)
    convolve_pixels<Vectors, 1> (row, x);
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

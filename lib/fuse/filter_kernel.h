/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Filter banks with weights that repeat along the row. */
#pragma once

#include "base/vector.h"
#include "fuse/kernels.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

using Floats = Vector<float>;
constexpr int kFloats = kLanes<float>;

/* What is done with a vector of an output. */
struct Put {
  CODEDEXPOSURE_INLINE void operator() (float *to, int, Floats value) const
  {
    store (to, value);
  }
};
struct Add {
  const float *scale;
  CODEDEXPOSURE_INLINE void operator() (float *to, int x, Floats value) const
  {
    store (to, load (to) + load (scale + x) * value);
  }
};

/* Outputs first .. first + Outputs - 1 of Vectors neighbouring vectors; Alike:
 * with the same weights. */
template <int Outputs, int Vectors, bool Alike, typename Finish>
CODEDEXPOSURE_INLINE void
filter_vectors (const fuse::FilterRow &row, int first, int x, Finish finish,
    float *const *outputs)
{
  Floats sum[Vectors][Outputs] = {};
  const float *weights[Vectors];
  for (int v = 0; v < Vectors; v++)
    weights[v] = row.weights + first * row.width +
                 (row.phase + x + (Alike ? 0 : v * kFloats)) % row.period;
  for (int t = 0; t < row.taps; t++) {
    const float *from = row.source + x + row.offsets[t];
    Floats weight[Outputs];
    for (int v = 0; v < Vectors; v++) {
      const Floats value = load (from + v * kFloats);
      for (int k = 0; k < Outputs; k++) {
        if (!Alike || v == 0)
          weight[k] = load (weights[v] + k * row.width);
        sum[v][k] += weight[k] * value;
      }
      weights[v] += row.outputs * row.width;
    }
  }
  for (int v = 0; v < Vectors; v++)
    for (int k = 0; k < Outputs; k++)
      finish (outputs[first + k] + x + v * kFloats, x + v * kFloats, sum[v][k]);
}

template <int Outputs, int Vectors, bool Alike, typename Finish,
    typename Wanted>
CODEDEXPOSURE_INLINE void
filter_along (const fuse::FilterRow &row, int first, Finish finish,
    Wanted wanted, float *const *outputs)
{
  int x = 0;
  for (; x + Vectors * kFloats <= row.count; x += Vectors * kFloats)
    if (wanted (x, Vectors * kFloats))
      filter_vectors<Outputs, Vectors, Alike> (row, first, x, finish, outputs);
  for (; x < row.count; x += kFloats)
    if (wanted (x, kFloats))
      filter_vectors<Outputs, 1, Alike> (row, first, x, finish, outputs);
}

/* Where whole periods fill a vector, neighbouring vectors share their weights:
 * as many as the registers hold sums of, as weights are read from further away
 * than pixels. Elsewhere a pair hides the latency of the sums. */
template <int Outputs, bool Alike, typename Finish, typename Wanted>
CODEDEXPOSURE_INLINE void
filter_outputs (const fuse::FilterRow &row, int first, Finish finish,
    Wanted wanted, float *const *outputs)
{
  constexpr int kPair = Outputs <= 4 ? 2 : 1;
  constexpr int kVectors = Alike && kVectorBytes == 64 ? 4 : kPair;
  filter_along<Outputs, kVectors, Alike> (row, first, finish, wanted, outputs);
}

template <typename Finish, typename Wanted>
CODEDEXPOSURE_INLINE void
filter_all (const fuse::FilterRow &row, Finish finish, Wanted wanted,
    float *const *outputs)
{
  const bool alike = kFloats % row.period == 0;
  int first = 0;
  if (!alike)
    for (; first + 8 <= row.outputs; first += 8)
      filter_outputs<8, false> (row, first, finish, wanted, outputs);
  for (; first + 4 <= row.outputs; first += 4)
    if (alike)
      filter_outputs<4, true> (row, first, finish, wanted, outputs);
    else
      filter_outputs<4, false> (row, first, finish, wanted, outputs);
  for (; first < row.outputs; first++)
    filter_outputs<1, false> (row, first, finish, wanted, outputs);
}

inline void
filter (const fuse::FilterRow &row, float *const *outputs)
{
  filter_all (
      row, Put (), [] (int, int) { return true; }, outputs);
}

inline void
filter_add (
    const fuse::FilterRow &row, const float *scale, float *const *outputs)
{
  const auto wanted = [scale] (int x, int count) {
    for (int i = x; i < x + count; i++)
      if (scale[i] != 0.0f)
        return true;
    return false;
  };
  filter_all (row, Add{scale}, wanted, outputs);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

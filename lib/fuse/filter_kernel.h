/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Filter banks with weights that repeat along the row. */
#pragma once

#include "base/vector.h"
#include "fuse/kernels.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

using Floats = Vector<float>;
constexpr int kFloats = kLanes<float>;

using Ints = Vector<std::int32_t>;

/* What is done with a vector of an output. */
struct Put {
  CODEDEXPOSURE_INLINE void operator() (float *to, int, Floats value) const
  {
    store (to, value);
  }
};
struct PutSquare {
  CODEDEXPOSURE_INLINE void operator() (float *to, int, Floats value) const
  {
    store (to, value * value);
  }
};

/* Each lane of the lower half twice. */
struct Twice {
  static constexpr int at (int lane) { return lane / 2; }
};

/* Values of pixels from @p x on, of which there is one for every two. */
CODEDEXPOSURE_INLINE Floats
load_twice (const float *from, int x)
{
  constexpr std::make_integer_sequence<int, kFloats> lanes;
  const Floats v = load (from + x / 2);
  return pick (v, v, Twice (), lanes);
}

struct Add {
  const float *share;
  CODEDEXPOSURE_INLINE void operator() (float *to, int x, Floats value) const
  {
    store (to, load (to) + load_twice (share, x) * value);
  }
};

CODEDEXPOSURE_INLINE Floats
add_product (Floats sum, Floats a, Floats b)
{
  return sum + a * b;
}

/* Both products of pairs of 16 bits. */
CODEDEXPOSURE_INLINE Ints
add_product (Ints sum, Ints a, Ints b)
{
#if defined __AVX512VNNI__
  return Ints (_mm512_dpwssd_epi32 (__m512i (sum), __m512i (a), __m512i (b)));
#elif defined __AVX512BW__
  return sum + Ints (_mm512_madd_epi16 (__m512i (a), __m512i (b)));
#elif defined __AVX2__
  return sum + Ints (_mm256_madd_epi16 (__m256i (a), __m256i (b)));
#elif defined __SSE2__
  return sum + Ints (_mm_madd_epi16 (__m128i (a), __m128i (b)));
#else
  const auto low = [] (Ints v) { return Ints (v << 16) >> 16; };
  return sum + low (a) * low (b) + (a >> 16) * (b >> 16);
#endif
}

/* Values of tap @t. */
CODEDEXPOSURE_INLINE const float *
source (const fuse::FilterRow &row, int t)
{
  return row.source + row.offsets[t];
}
CODEDEXPOSURE_INLINE const std::int32_t *
source (const fuse::PairRow &row, int t)
{
  return row.sources[t];
}

/* Output @k of a vector at @at of the period, from its sum. */
CODEDEXPOSURE_INLINE Floats
result (const fuse::FilterRow &, int, int, Floats sum)
{
  return sum;
}
CODEDEXPOSURE_INLINE Floats
result (const fuse::PairRow &row, int k, int at, Ints sum)
{
  return load (row.scale + k * row.width + at) *
             __builtin_convertvector(sum, Floats) +
         row.base;
}

/* Outputs first .. first + Outputs - 1 of Vectors neighbouring vectors; Alike:
 * with the same weights. */
template <int Outputs, int Vectors, bool Alike, typename Row, typename Finish>
CODEDEXPOSURE_INLINE void
filter_vectors (
    const Row &row, int first, int x, Finish finish, float *const *outputs)
{
  using Values = decltype (load (row.weights));
  Values sum[Vectors][Outputs] = {};
  decltype (row.weights) weights[Vectors];
  int at[Vectors];
  for (int v = 0; v < Vectors; v++) {
    at[v] = (row.phase + x + (Alike ? 0 : v * kFloats)) % row.period;
    weights[v] = row.weights + first * row.width + at[v];
  }
  for (int t = 0; t < row.taps; t++) {
    const auto *from = source (row, t) + x;
    Values weight[Outputs];
    for (int v = 0; v < Vectors; v++) {
      const Values value = load (from + v * kFloats);
      for (int k = 0; k < Outputs; k++) {
        if (!Alike || v == 0)
          weight[k] = load (weights[v] + k * row.width);
        sum[v][k] = add_product (sum[v][k], weight[k], value);
      }
      weights[v] += row.outputs * row.width;
    }
  }
  for (int v = 0; v < Vectors; v++)
    for (int k = 0; k < Outputs; k++)
      finish (outputs[first + k] + x + v * kFloats, x + v * kFloats,
          result (row, first + k, at[v], sum[v][k]));
}

template <int Outputs, int Vectors, bool Alike, typename Row, typename Finish,
    typename Wanted>
CODEDEXPOSURE_INLINE void
filter_along (const Row &row, int first, Finish finish, Wanted wanted,
    float *const *outputs)
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
template <int Outputs, bool Alike, typename Row, typename Finish,
    typename Wanted>
CODEDEXPOSURE_INLINE void
filter_outputs (const Row &row, int first, Finish finish, Wanted wanted,
    float *const *outputs)
{
  constexpr int kPair = Outputs <= 4 ? 2 : 1;
  constexpr int kVectors = Alike && kVectorBytes == 64 ? 4 : kPair;
  filter_along<Outputs, kVectors, Alike> (row, first, finish, wanted, outputs);
}

template <typename Row, typename Finish, typename Wanted>
CODEDEXPOSURE_INLINE void
filter_all (const Row &row, Finish finish, Wanted wanted, float *const *outputs)
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

struct Everywhere {
  CODEDEXPOSURE_INLINE bool operator() (int, int) const { return true; }
};

inline void
filter (const fuse::FilterRow &row, float *const *outputs)
{
  filter_all (row, Put (), Everywhere (), outputs);
}

inline void
filter_pairs_squared (const fuse::PairRow &row, float *const *outputs)
{
  filter_all (row, PutSquare (), Everywhere (), outputs);
}

inline void
filter_pairs_add (
    const fuse::PairRow &row, const float *share, float *const *outputs)
{
  const auto wanted = [share] (int x, int count) {
    for (int i = x / 2; i < (x + count) / 2; i++)
      if (share[i] != 0.0f)
        return true;
    return false;
  };
  filter_all (row, Add{share}, wanted, outputs);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Filters of pixels that all have the same ones. */
#pragma once

#include "base/vector.h"
#include "fuse/kernels.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

using Floats = Vector<float>;
constexpr int kFloats = kLanes<float>;

using Ints = Vector<std::int32_t>;

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

/* What is done with a vector of an output. */
struct AddSquare {
  CODEDEXPOSURE_INLINE void operator() (float *to, int i, Floats value) const
  {
    store (to + i, load (to + i) + value * value);
  }
};
struct AddShare {
  const float *share;
  CODEDEXPOSURE_INLINE void operator() (float *to, int i, Floats value) const
  {
    store (to + i, load (to + i) + load (share + i) * value);
  }
};

constexpr int kRunVectors = fuse::kRunBlock / kFloats;

/* Outputs first .. first + Outputs - 1 of some blocks from @p at on. */
template <int Outputs, int Blocks, typename Finish>
CODEDEXPOSURE_INLINE void
filter_blocks (const fuse::FilterRow &row, int first, int at, Finish finish,
    float *const *to)
{
  constexpr int kVectors = Blocks * kRunVectors;
  Ints sum[kVectors][Outputs] = {};
  const std::int32_t *pair = row.pairs;
  for (int t = 0; t < row.pairs_count; t++, pair += 1 + row.outputs) {
    const std::int32_t *from = row.sources[pair[0]] + at;
    Ints weight[Outputs];
    for (int k = 0; k < Outputs; k++)
      weight[k] = Ints{} + pair[1 + first + k];
    for (int v = 0; v < kVectors; v++) {
      const Ints value = load (from + v * kFloats);
      for (int k = 0; k < Outputs; k++)
        sum[v][k] = add_product (sum[v][k], weight[k], value);
    }
  }
  for (int v = 0; v < kVectors; v++)
    for (int k = 0; k < Outputs; k++)
      finish (to[first + k], at + v * kFloats,
          row.scale[first + k] * __builtin_convertvector(sum[v][k], Floats) +
              row.base);
}

/* As many blocks at a time as the registers hold sums of. */
template <int Outputs, int Blocks, typename Finish>
CODEDEXPOSURE_INLINE void
filter_run (const fuse::FilterRow &row, int first, int at, int end,
    Finish finish, float *const *to)
{
  constexpr int kStep = Blocks * fuse::kRunBlock;
  for (; at + kStep <= end; at += kStep)
    filter_blocks<Outputs, Blocks> (row, first, at, finish, to);
  if constexpr (Blocks > 1)
    filter_run<Outputs, Blocks == 6 ? 4 : Blocks / 2> (
        row, first, at, end, finish, to);
}

template <int Outputs, typename Finish>
CODEDEXPOSURE_INLINE void
filter_outputs (
    const fuse::FilterRow &row, int first, Finish finish, float *const *to)
{
  constexpr int kAlone = kVectorBytes == 64 ? 6 : kVectorBytes / 8;
  constexpr int kTogether = kVectorBytes == 64 ? 4 : 1;
  for (int i = 0; i < row.runs_count; i++) {
    const auto [at, count] = row.runs[i];
    filter_run<Outputs, (Outputs > 1 ? kTogether : kAlone)> (
        row, first, at, at + count, finish, to);
  }
}

/* Some outputs at a time, so that pixels are read once for them. */
template <typename Finish>
CODEDEXPOSURE_INLINE void
filter_all (const fuse::FilterRow &row, Finish finish, float *const *to)
{
  constexpr int kSome = kVectorBytes == 16 ? 2 : 4;
  int first = 0;
  for (; first + kSome <= row.outputs; first += kSome)
    filter_outputs<kSome> (row, first, finish, to);
  for (; first < row.outputs; first++)
    filter_outputs<1> (row, first, finish, to);
}

inline void
filter_squared (const fuse::FilterRow &row, float *const *to)
{
  filter_all (row, AddSquare (), to);
}

inline void
filter_add (const fuse::FilterRow &row, const float *share, float *const *to)
{
  filter_all (row, AddShare{share}, to);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

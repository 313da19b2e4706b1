/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rows of pixels and their parts: every few pixels, which have the same filter.
 */
#pragma once

#include "extract/split.h"
#include "fuse/filter_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/* Lanes of two vectors in a row, those of both in turn. */
template <int Lanes, int First>
struct InTurn {
  static constexpr int at (int lane)
  {
    return First + lane / 2 + (lane % 2 ? Lanes : 0);
  }
};

template <int Period>
CODEDEXPOSURE_INLINE void
join_vectors (Floats *v)
{
  if constexpr (Period > 1) {
    constexpr std::make_integer_sequence<int, kFloats> lanes;
    Floats even[Period / 2], odd[Period / 2];
    for (int i = 0; i < Period / 2; i++) {
      even[i] = v[2 * i];
      odd[i] = v[2 * i + 1];
    }
    join_vectors<Period / 2> (even);
    join_vectors<Period / 2> (odd);
    for (int i = 0; i < Period / 2; i++) {
      v[2 * i] = pick (even[i], odd[i], InTurn<kFloats, 0> (), lanes);
      v[2 * i + 1] =
          pick (even[i], odd[i], InTurn<kFloats, kFloats / 2> (), lanes);
    }
  }
}

/* Returns the number of pixels that whole vectors hold. */
template <int Period, typename T>
CODEDEXPOSURE_INLINE int
split_period (const fuse::Parts &parts, const T *from, T *to)
{
  int x = 0;
  for (; x + Period * kFloats <= parts.count; x += Period * kFloats) {
    Vector<T> v[Period];
    split_cells<Period, T> (from + x, v);
    for (int i = 0; i < Period; i++)
      store (to + i * parts.stride + x / Period, v[i]);
  }
  return x;
}

template <int Period>
CODEDEXPOSURE_INLINE int
join_period (
    const fuse::Parts &parts, const float *from, const float *add, float *to)
{
  int x = 0;
  for (; x + Period * kFloats <= parts.count; x += Period * kFloats) {
    Floats v[Period];
    for (int i = 0; i < Period; i++)
      v[i] = load (from + i * parts.stride + x / Period);
    join_vectors<Period> (v);
    for (int i = 0; i < Period; i++) {
      const int at = x + i * kFloats;
      store (to + at, add ? load (add + at) + v[i] : v[i]);
    }
  }
  return x;
}

template <typename T>
void
split_parts (const fuse::Parts &parts, const T *from, T *to)
{
  int x = 0;
  if (parts.period == 2)
    x = split_period<2> (parts, from, to);
  else if (parts.period == 4)
    x = split_period<4> (parts, from, to);
  else if (parts.period == 8)
    x = split_period<8> (parts, from, to);
  for (int c = 0; c < parts.period; c++)
    for (int at = x + c; at < parts.count; at += parts.period)
      to[c * parts.stride + at / parts.period] = from[at];
}

inline void
join (const fuse::Parts &parts, const float *from, const float *add, float *to)
{
  int x = 0;
  if (parts.period == 2)
    x = join_period<2> (parts, from, add, to);
  else if (parts.period == 4)
    x = join_period<4> (parts, from, add, to);
  else if (parts.period == 8)
    x = join_period<8> (parts, from, add, to);
  for (int c = 0; c < parts.period; c++)
    for (int at = x + c; at < parts.count; at += parts.period) {
      const float value = from[c * parts.stride + at / parts.period];
      to[at] = add ? add[at] + value : value;
    }
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

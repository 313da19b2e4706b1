/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Vectors of pixels as wide as the instruction set this file is compiled for.
 *
 * Included only by files that are compiled once per instruction set. All that
 * they define lies in a namespace of its own, CODEDEXPOSURE_TARGET, and they
 * call no inline function from elsewhere, the standard library's included: the
 * linker keeps one copy of such a function, and it could be one that the
 * processor cannot run. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace codedexposure::CODEDEXPOSURE_TARGET
{

constexpr int kVectorBytes = CODEDEXPOSURE_VECTOR_BYTES;

template <typename T>
struct VectorOf {
  typedef T Type __attribute__ ((vector_size (kVectorBytes)));
};
template <typename T>
using Vector = typename VectorOf<T>::Type;
template <typename T>
constexpr int kLanes = kVectorBytes / int (sizeof (T));

#define CODEDEXPOSURE_INLINE [[gnu::always_inline]] inline
#define CODEDEXPOSURE_INLINE_BODY __attribute__ ((always_inline))

template <typename T>
CODEDEXPOSURE_INLINE Vector<T>
load (const T *from)
{
  Vector<T> v;
  __builtin_memcpy (&v, from, kVectorBytes);
  return v;
}

template <typename T>
CODEDEXPOSURE_INLINE void
store (T *to, Vector<T> v)
{
  __builtin_memcpy (to, &v, kVectorBytes);
}

template <typename V>
CODEDEXPOSURE_INLINE V
smaller (V a, V b)
{
  return a < b ? a : b;
}

template <typename V>
CODEDEXPOSURE_INLINE V
larger (V a, V b)
{
  return a < b ? b : a;
}

/** Lane i of the result is lane Index (i) of a and b in a row. */
template <typename V, typename Index, int... I>
CODEDEXPOSURE_INLINE V
pick (V a, V b, Index, std::integer_sequence<int, I...>)
{
  return __builtin_shufflevector (a, b, Index::at (I)...);
}

/** Every second lane of two vectors in a row, from lane First on. */
template <int First>
struct EverySecond {
  static constexpr int at (int lane) { return 2 * lane + First; }
};

/** The lanes, each moved down by By places, those at the end to the start. */
template <int Lanes, int By>
struct Rotate {
  static constexpr int at (int lane) { return (lane + By) % Lanes; }
};

template <typename T, int Reach = kLanes<T> / 2>
CODEDEXPOSURE_INLINE T
largest_lane (Vector<T> v)
{
  if constexpr (Reach == 0) {
    return v[0];
  } else {
    constexpr std::make_integer_sequence<int, kLanes<T>> lanes;
    return largest_lane<T, Reach / 2> (
        larger (v, pick (v, v, Rotate<kLanes<T>, Reach> (), lanes)));
  }
}

/** Fetches @p bytes bytes before they are needed: rows of large frames end with
 * their page, where the processor stops prefetching. They need not exist. */
template <typename T>
CODEDEXPOSURE_INLINE void
prefetch (const T *from, int bytes)
{
  const char *first = reinterpret_cast<const char *> (from);
  for (int at = 0; at < bytes; at += 64)
    __builtin_prefetch (first + at);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

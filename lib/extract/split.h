/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rows of cells into one vector for each pixel of the cell. */
#pragma once

#include <type_traits>

#include "base/vector.h"
#include "extract/kernels.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/* Width vectors in a row hold pixel x of cell i at position i Width + x. For an
 * odd width the lanes that belong to one x are blended from all vectors, where
 * they already stand in lanes that differ, and put in order by one permutation
 * at the end: blends are cheaper than permutations everywhere. */

/** Takes, in the lanes that belong to pixel X, vector Source. */
template <int Lanes, int Width, int X, int Source>
struct Blend {
  static constexpr int at (int lane)
  {
    return (Source * Lanes + lane) % Width == X ? Lanes + lane : lane;
  }
};

template <int Lanes, int Width, int X>
struct InOrder {
  static constexpr int at (int lane) { return (lane * Width + X) % Lanes; }
};

template <int Width, int X, typename T, int... Source>
CODEDEXPOSURE_INLINE Vector<T>
gather_odd (const Vector<T> (&in)[Width], std::integer_sequence<int, Source...>)
{
  constexpr int kL = kLanes<T>;
  constexpr std::make_integer_sequence<int, kL> lanes;
  Vector<T> v = in[0];
  ((v = pick (v, in[Source + 1], Blend<kL, Width, X, Source + 1> (), lanes)),
      ...);
  return pick (v, v, InOrder<kL, Width, X> (), lanes);
}

constexpr int
smallest_factor (int n)
{
  int factor = 2;
  while (n % factor != 0)
    factor++;
  return factor;
}

template <int Width, typename T>
CODEDEXPOSURE_INLINE void split_vectors (
    const Vector<T> (&in)[Width], Vector<T> (&out)[Width]);

/** One stage: the Width vectors become Factor streams of every Factor-th
 * pixel, which are split further. */
template <int Width, int Factor, int X, typename T>
CODEDEXPOSURE_INLINE void
split_stream (const Vector<T> (&in)[Width], Vector<T> (&out)[Width])
{
  constexpr int kRest = Width / Factor;
  constexpr std::make_integer_sequence<int, kLanes<T>> lanes;
  Vector<T> streamed[kRest];
  Vector<T> parts[kRest];
#pragma GCC unroll 256
  for (int v = 0; v < kRest; v++) {
    if constexpr (Factor == 2) {
      streamed[v] = pick (in[2 * v], in[2 * v + 1], EverySecond<X> (), lanes);
    } else {
      Vector<T> group[Factor];
#pragma GCC unroll 256
      for (int i = 0; i < Factor; i++)
        group[i] = in[v * Factor + i];
      streamed[v] = gather_odd<Factor, X, T> (
          group, std::make_integer_sequence<int, Factor - 1> ());
    }
  }
  split_vectors<kRest, T> (streamed, parts);
#pragma GCC unroll 256
  for (int v = 0; v < kRest; v++)
    out[X + Factor * v] = parts[v];
}

template <int Width, typename T, int... X>
CODEDEXPOSURE_INLINE void
split_streams (const Vector<T> (&in)[Width], Vector<T> (&out)[Width],
    std::integer_sequence<int, X...>)
{
  (split_stream<Width, int (sizeof...(X)), X, T> (in, out), ...);
}

/** out[x] lane i = pixel x of cell i. */
template <int Width, typename T>
CODEDEXPOSURE_INLINE void
split_vectors (const Vector<T> (&in)[Width], Vector<T> (&out)[Width])
{
  if constexpr (Width == 1)
    out[0] = in[0];
  else
    split_streams<Width, T> (
        in, out, std::make_integer_sequence<int, smallest_factor (Width)> ());
}

/** The same from memory, which is read once and no further. */
template <int Width, typename T>
CODEDEXPOSURE_INLINE void
split_cells (const T *from, Vector<T> (&out)[Width])
{
  Vector<T> in[Width];
#pragma GCC unroll 256
  for (int v = 0; v < Width; v++)
    in[v] = load (from + v * kLanes<T>);
  split_vectors<Width, T> (in, out);
}

template <typename T>
CODEDEXPOSURE_INLINE T *
bytes_on (T *p, std::ptrdiff_t bytes)
{
  using Byte = std::conditional_t<std::is_const_v<T>, const char, char>;
  return reinterpret_cast<T *> (reinterpret_cast<Byte *> (p) + bytes);
}

/** Writes a vector, with a non-temporal store where that is asked for and
 * vectors are lines of the cache. */
struct Put {
  bool stream;
  template <typename T, typename V>
  CODEDEXPOSURE_INLINE void operator() (T *to, V v) const
  {
#if CODEDEXPOSURE_VECTOR_BYTES == 64
    if (stream)
      return _mm512_stream_si512 (
          reinterpret_cast<__m512i *> (to), __m512i (v));
#endif
    store (to, v);
  }
};

/** Calls body (at, put) for all cells of a row, Count at a time; the last ones
 * are moved back to end with the row. */
template <int Count, typename Body>
CODEDEXPOSURE_INLINE void
for_strips (int cells, bool stream, Body body)
{
  int at = 0;
  for (; at + Count <= cells; at += Count)
    body (at, Put{stream});
  if (at < cells)
    body (cells - Count, Put{false});
}

/* The widths of cells that are split by permutations. */
constexpr int kOwnWidths = 16;

constexpr bool
has_own_code (int width)
{
  return (width >= 1 && width <= 10) || width == 12 || width == 16;
}

/** One vector of cells, one row of their pixels; Width 0: any. Fetches the row
 * @p ahead bytes further on. Returns the largest pixels. */
template <int Width, typename T>
CODEDEXPOSURE_INLINE Vector<T>
split_row (const T *from, int width, T *const *out, std::ptrdiff_t at, Put put,
    std::ptrdiff_t ahead)
{
  prefetch (bytes_on (from, ahead), (Width > 0 ? Width : width) * kVectorBytes);
  Vector<T> most = {};
  if constexpr (Width == 0) {
    for (int x = 0; x < width; x++) {
      Vector<T> part;
      for (int i = 0; i < kLanes<T>; i++)
        part[i] = from[i * width + x];
      most = larger (most, part);
      put (out[x] + at, part);
    }
  } else {
    Vector<T> parts[Width];
    split_cells<Width, T> (from, parts);
#pragma GCC unroll 16
    for (int x = 0; x < Width; x++) {
      most = larger (most, parts[x]);
      put (out[x] + at, parts[x]);
    }
  }
  return most;
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

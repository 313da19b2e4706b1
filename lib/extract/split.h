/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rows of cells into one vector for each pixel of the cell. */
#pragma once

#include "extract/kernels.h"
#include "extract/vector.h"

namespace cexp::CEXP_TARGET
{

/** Every second lane of two vectors, from lane First on. */
template <int First>
struct EverySecond {
  static constexpr int at (int lane) { return 2 * lane + First; }
};

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
CEXP_INLINE Vector<T>
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
CEXP_INLINE void split_vectors (
    const Vector<T> (&in)[Width], Vector<T> (&out)[Width]);

/** One stage: the Width vectors become Factor streams of every Factor-th
 * pixel, which are split further. */
template <int Width, int Factor, int X, typename T>
CEXP_INLINE void
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
CEXP_INLINE void
split_streams (const Vector<T> (&in)[Width], Vector<T> (&out)[Width],
    std::integer_sequence<int, X...>)
{
  (split_stream<Width, int (sizeof...(X)), X, T> (in, out), ...);
}

/** out[x] lane i = pixel x of cell i. */
template <int Width, typename T>
CEXP_INLINE void
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
CEXP_INLINE void
split_cells (const T *from, Vector<T> (&out)[Width])
{
  Vector<T> in[Width];
#pragma GCC unroll 256
  for (int v = 0; v < Width; v++)
    in[v] = load (from + v * kLanes<T>);
  split_vectors<Width, T> (in, out);
}

/** Calls body (at, streams) for every vector of a row; see Strips. */
template <typename T, typename Body>
CEXP_INLINE void
for_strips (const Strips &strips, Body body)
{
  constexpr int kL = kLanes<T>;
  const auto plain = [] (T *to, Vector<T> v) { store (to, v); };
  const auto past_caches = [] (T *to, Vector<T> v) { stream (to, v); };
  int at = 0;
  if (strips.stream) {
    if (strips.lead > 0)
      body (0, plain);
    for (at = strips.lead; at + kL <= strips.cells; at += kL)
      body (at, past_caches);
  } else {
    for (; at + kL <= strips.cells; at += kL)
      body (at, plain);
  }
  if (at < strips.cells)
    body (strips.cells - kL, plain);
}

/** Kernels::split for one width. */
template <int Width, typename T>
T
split_row (const T *row, int, T *const *out, const Strips &strips)
{
  Vector<T> most = {};
  for_strips<T> (strips, [&] (int at, auto put) CEXP_INLINE_BODY {
    Vector<T> parts[Width];
    split_cells<Width, T> (row + at * Width, parts);
#pragma GCC unroll 256
    for (int x = 0; x < Width; x++) {
      most = larger (most, parts[x]);
      put (out[x] + at, parts[x]);
    }
  });
  return largest_lane<T> (most);
}

/* Cells wider than that are turned in square blocks of 16 bytes: a row of a
 * block is a piece of a cell, a column is a piece of an output row. */

template <typename T>
struct BlockOf {
  static constexpr int kSize = 16 / int (sizeof (T));
  typedef T Row __attribute__ ((vector_size (16)));
};

/** The lower (Half = 0) or upper halves of two rows, interleaved. */
template <int Size, int Half>
struct Interleave {
  static constexpr int at (int lane)
  {
    return lane / 2 + Half * Size / 2 + lane % 2 * Size;
  }
};

template <typename T>
CEXP_INLINE void turn (typename BlockOf<T>::Row (&rows)[BlockOf<T>::kSize])
{
  constexpr int kSize = BlockOf<T>::kSize;
  constexpr std::make_integer_sequence<int, kSize> lanes;
  for (int step = 1; step < kSize; step *= 2) {
    typename BlockOf<T>::Row next[kSize];
#pragma GCC unroll 16
    for (int r = 0; r < kSize / 2; r++) {
      next[2 * r] =
          pick (rows[r], rows[r + kSize / 2], Interleave<kSize, 0> (), lanes);
      next[2 * r + 1] =
          pick (rows[r], rows[r + kSize / 2], Interleave<kSize, 1> (), lanes);
    }
#pragma GCC unroll 16
    for (int r = 0; r < kSize; r++)
      rows[r] = next[r];
  }
}

/** Kernels::split for cells at least as wide as a block. */
template <typename T>
T
split_wide_row (const T *row, int width, T *const *out, const Strips &strips)
{
  using Row = typename BlockOf<T>::Row;
  constexpr int kSize = BlockOf<T>::kSize;
  Row most = {};
  for (int i = 0; i < strips.cells; i += kSize) {
    const int cell = i + kSize <= strips.cells ? i : strips.cells - kSize;
    for (int x = 0; x < width; x += kSize) {
      const int pixel = x + kSize <= width ? x : width - kSize;
      Row block[kSize];
      for (int r = 0; r < kSize; r++) {
        __builtin_memcpy (&block[r], row + (cell + r) * width + pixel, 16);
        most = larger (most, block[r]);
      }
      turn<T> (block);
      for (int r = 0; r < kSize; r++)
        __builtin_memcpy (out[pixel + r] + cell, &block[r], 16);
    }
  }
  T peak = 0;
  for (int lane = 0; lane < kSize; lane++)
    peak = most[lane] > peak ? most[lane] : peak;
  return peak;
}

/** Widths that have a kernel of their own. */
constexpr int kOwnWidths = 16;

template <typename T>
using SplitRow = T (*) (const T *, int, T *const *, const Strips &);

template <typename T, typename Widths>
struct SplitTable;
template <typename T, int... I>
struct SplitTable<T, std::integer_sequence<int, I...>> {
  static constexpr SplitRow<T> kRows[] = {split_row<I + 1, T>...};
};

template <typename T>
T
split (const T *row, int width, T *const *out, const Strips &strips)
{
  using Table = SplitTable<T, std::make_integer_sequence<int, kOwnWidths>>;
  const SplitRow<T> own =
      width <= kOwnWidths ? Table::kRows[width - 1] : split_wide_row<T>;
  return own (row, width, out, strips);
}

} // namespace cexp::CEXP_TARGET

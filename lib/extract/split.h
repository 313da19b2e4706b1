/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rows of cells into one vector for each pixel of the cell. */
#pragma once

#include <type_traits>

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

template <typename T>
CEXP_INLINE T *
bytes_on (T *p, std::ptrdiff_t bytes)
{
  using Byte = std::conditional_t<std::is_const_v<T>, const char, char>;
  return reinterpret_cast<T *> (reinterpret_cast<Byte *> (p) + bytes);
}

/** Writes a vector. */
struct Put {
  static constexpr bool kStreams = false;
  template <typename T, typename V>
  CEXP_INLINE void operator() (T *to, V v) const
  {
    store (to, v);
  }
};

#if CEXP_VECTOR_BYTES == 64
/** Writes a vector past the caches. */
struct PutPastCaches {
  static constexpr bool kStreams = true;
  template <typename T, typename V>
  CEXP_INLINE void operator() (T *to, V v) const
  {
    stream (to, v);
  }
};

/** Writes the lanes of a vector whose bits are set. */
struct PutLanes {
  static constexpr bool kStreams = false;
  std::uint64_t lanes;
  template <typename T, typename V>
  CEXP_INLINE void operator() (T *to, V v) const
  {
    if constexpr (sizeof (T) == 1)
      _mm512_mask_storeu_epi8 (to, lanes, __m512i (v));
    else
      _mm512_mask_storeu_epi16 (to, __mmask32 (lanes), __m512i (v));
  }
};

/** for_strips () past the caches. A line that is written both ways costs a trip
 * to memory, so what lies before the first whole line and after the last is
 * written by single lanes. */
template <typename T, typename Body>
CEXP_INLINE void
stream_strips (int cells, int lead, Body body)
{
  constexpr int kL = kLanes<T>;
  if (lead > 0)
    body (0, PutLanes{(std::uint64_t (1) << lead) - 1});
  int at = lead;
  for (; at + kL <= cells; at += kL)
    body (at, PutPastCaches ());
  if (at < cells)
    body (cells - kL, PutLanes{~std::uint64_t (0) << (kL - (cells - at))});
}
#endif

/**
 * Calls body (at, put) for every vector of a row of cells whose first output
 * pixel is @p to; put (to, vector) writes past the caches where it may.
 */
template <typename T, typename Body>
CEXP_INLINE void
for_strips (int cells, [[maybe_unused]] const T *to,
    [[maybe_unused]] bool streams, Body body)
{
  constexpr int kL = kLanes<T>;
#if CEXP_VECTOR_BYTES == 64
  const auto address = reinterpret_cast<std::uintptr_t> (to);
  const int lead = int (-address % kVectorBytes / sizeof (T));
  if (streams && lead + kL <= cells)
    return stream_strips<T> (cells, lead, body);
#endif
  int at = 0;
  for (; at + kL <= cells; at += kL)
    body (at, Put ());
  if (at < cells)
    body (cells - kL, Put ());
}

/* Cells wider than kOwnWidths are turned in square blocks of 16 bytes: a row of
 * a block is a piece of a cell, a column is a piece of an output row. */
constexpr int kOwnWidths = 16;

template <typename T>
struct SquareOf {
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
CEXP_INLINE void turn (typename SquareOf<T>::Row (&rows)[SquareOf<T>::kSize])
{
  constexpr int kSize = SquareOf<T>::kSize;
  constexpr std::make_integer_sequence<int, kSize> lanes;
  for (int step = 1; step < kSize; step *= 2) {
    typename SquareOf<T>::Row next[kSize];
#pragma GCC unroll 16
    for (int r = 0; r < kSize / 2; r++) {
      const auto &upper = rows[r], &lower = rows[r + kSize / 2];
      next[2 * r] = pick (upper, lower, Interleave<kSize, 0> (), lanes);
      next[2 * r + 1] = pick (upper, lower, Interleave<kSize, 1> (), lanes);
    }
#pragma GCC unroll 16
    for (int r = 0; r < kSize; r++)
      rows[r] = next[r];
  }
}

/** One vector of cells @p width pixels wide, at least the size of a square:
 * out[x] + at takes pixel x. */
template <typename T>
CEXP_INLINE Vector<T>
split_wide (const T *from, int width, T *const *out, int at)
{
  using Row = typename SquareOf<T>::Row;
  constexpr int kSize = SquareOf<T>::kSize;
  Row most = {};
  for (int i = 0; i < kLanes<T>; i += kSize) {
    for (int x = 0; x < width; x += kSize) {
      const int pixel = x + kSize <= width ? x : width - kSize;
      Row square[kSize];
      for (int r = 0; r < kSize; r++) {
        __builtin_memcpy (&square[r], from + (i + r) * width + pixel, 16);
        most = larger (most, square[r]);
      }
      turn<T> (square);
      for (int r = 0; r < kSize; r++)
        __builtin_memcpy (out[pixel + r] + at + i, &square[r], 16);
    }
  }
  Vector<T> result = {};
  __builtin_memcpy (&result, &most, 16);
  return result;
}

/** All vectors of one row of pixels; Width 0: any. Fetches the row @p ahead
 * bytes further on. Returns the largest pixels. */
template <int Width, typename T>
CEXP_INLINE Vector<T>
split_row (const T *row, int width, int cells, T *const *out, bool streams,
    std::ptrdiff_t ahead)
{
  Vector<T> most = {};
  for_strips<T> (
      cells, out[0], streams, [&] (int at, auto put) CEXP_INLINE_BODY {
        prefetch (bytes_on (row, ahead) + at * width,
            (Width > 0 ? Width : width) * kVectorBytes);
        if constexpr (Width == 0) {
          most =
              larger (most, split_wide<T> (row + at * width, width, out, at));
        } else {
          Vector<T> parts[Width];
          split_cells<Width, T> (row + at * Width, parts);
#pragma GCC unroll 256
          for (int x = 0; x < Width; x++) {
            most = larger (most, parts[x]);
            put (out[x] + at, parts[x]);
          }
        }
      });
  return most;
}

/** One vector of cells, all places of the cell: places[p] takes the pixels. */
template <int Width, typename T>
Vector<T>
split_strip (const Block<T> &block, int j, int at, T *const *places)
{
  constexpr int kL = kLanes<T>;
  Vector<T> most = {};
  for (int y = 0; y < block.height; y++) {
    const T *row = bytes_on (block.pixels,
                       (std::ptrdiff_t (j) * block.height + y) * block.stride) +
                   at * block.width;
    most = larger (most,
        split_row<Width, T> (row, block.width, kL, places + y * block.width,
            false, block.height * block.stride));
  }
  return most;
}

/** Width 0 stands for any. */
using OwnWidths = std::make_integer_sequence<int, kOwnWidths + 1>;

template <typename T>
using SplitStrip = Vector<T> (*) (
    const Block<T> &, int j, int at, T *const *places);

template <typename T, int... Width>
SplitStrip<T>
split_strip_of (int width, std::integer_sequence<int, Width...>)
{
  static constexpr SplitStrip<T> kAll[] = {split_strip<Width, T>...};
  return kAll[width <= kOwnWidths ? width : 0];
}

template <typename T>
SplitStrip<T>
split_strip_of (int width)
{
  return split_strip_of<T> (width, OwnWidths ());
}

/** Brings one vector of all places into the order of the elements where that
 * differs from cell to cell: rows[e] takes element e. */
template <typename T, typename PutVector>
CEXP_INLINE void
relabel_strip (const Layout<T> &layout, int j, int at, const T *const *places,
    T *const *rows, std::ptrdiff_t to, PutVector put)
{
  const int repeat = layout.repeat;
  const std::uint8_t *place =
      layout.place + (j + layout.row) % layout.rows * layout.n * repeat;
  alignas (kVectorBytes) T masks[256 * kLanes<T>];
  for (int c = 0; c < repeat; c++)
    store (masks + c * kLanes<T>,
        load (layout.comb + (at + layout.column + repeat - c) % repeat));
  for (int e = 0; e < layout.n; e++) {
    Vector<T> v = {};
    for (int c = 0; c < repeat; c++)
      v |= load (masks + c * kLanes<T>) & load (places[place[e * repeat + c]]);
    put (rows[e] + to, v);
  }
}

/** A vector for each of up to 256 wires. */
template <typename T>
struct Wires {
  alignas (64) T lanes[256 * kLanes<T>];
  T *rows[256];

  explicit Wires (int n)
  {
    for (int w = 0; w < n; w++)
      rows[w] = lanes + w * kLanes<T>;
  }
};

} // namespace cexp::CEXP_TARGET

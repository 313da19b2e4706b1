/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rows of cells into one vector for each pixel of the cell. */
#pragma once

#include <type_traits>

#include "base/vector.h"
#include "extract/kernels.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
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

/** Writes a vector. */
struct Put {
  CODEDEXPOSURE_INLINE bool streams () const { return false; }
  template <typename T, typename V>
  CODEDEXPOSURE_INLINE void operator() (T *to, V v) const
  {
    store (to, v);
  }
};

#if CODEDEXPOSURE_VECTOR_BYTES == 64
/** Writes a whole vector with a non-temporal store, or only the lanes whose
 * bits are set. */
struct PutStream {
  std::uint64_t lanes;
  CODEDEXPOSURE_INLINE bool streams () const { return lanes + 1 == 0; }
  template <typename T, typename V>
  CODEDEXPOSURE_INLINE void operator() (T *to, V v) const
  {
    if (streams ())
      stream (to, v);
    else if constexpr (sizeof (T) == 1)
      _mm512_mask_storeu_epi8 (to, lanes, __m512i (v));
    else
      _mm512_mask_storeu_epi16 (to, __mmask32 (lanes), __m512i (v));
  }
};

/** for_strips () with non-temporal stores. A line that is written both ways
 * costs an access to memory, so what lies before the first whole line and after
 * the last is written by single lanes. */
template <typename T, typename Body>
CODEDEXPOSURE_INLINE void
stream_strips (int cells, int lead, Body body)
{
  constexpr int kL = kLanes<T>;
  constexpr std::uint64_t kAll = ~std::uint64_t (0);
  const int last = cells - kL;
  for (int line = lead > 0 ? lead - kL : 0; line < cells; line += kL) {
    const std::uint64_t lanes = line < 0      ? ~(kAll << lead)
                                : line > last ? kAll << (line - last)
                                              : kAll;
    body (line < 0 ? 0 : line < last ? line : last, PutStream{lanes});
  }
}
#endif

/**
 * Calls body (at, put) for every vector of a row of cells whose first output
 * pixel is @p to; put (to, vector) uses non-temporal stores where it may.
 */
template <typename T, typename Body>
CODEDEXPOSURE_INLINE void
for_strips (int cells, [[maybe_unused]] const T *to,
    [[maybe_unused]] bool streams, Body body)
{
  constexpr int kL = kLanes<T>;
#if CODEDEXPOSURE_VECTOR_BYTES == 64
  const auto address = reinterpret_cast<std::uintptr_t> (to);
  const int lead = int (-address % kVectorBytes / sizeof (T));
  if (streams && lead + kL <= cells)
    return stream_strips<T> (cells, lead, body);
#endif
  for (int at = 0; at < cells; at += kL)
    body (at + kL <= cells ? at : cells - kL, Put ());
}

/* The widths of cells that have code of their own. Others are transposed in
 * squares of 16 bytes: a row of a square is a piece of a cell, a column is a
 * piece of an output row. */
constexpr int kOwnWidths = 16;

/* Plain x86-64 cannot permute bytes: the compiler would move them one by one. */
#if defined __SSE2__ && !defined __SSSE3__
constexpr bool kPermutesBytes = false;
#else
constexpr bool kPermutesBytes = true;
#endif

constexpr bool
has_own_code (int width)
{
  if (!kPermutesBytes)
    return width == 1 || width == 2 || width == 4 || width == 8;
  return (width >= 1 && width <= 10) || width == 12 || width == 16;
}

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
CODEDEXPOSURE_INLINE void transpose (
    typename SquareOf<T>::Row (&rows)[SquareOf<T>::kSize])
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

/** The first pixels of a cell narrower than a square, with those before it in
 * front and nothing of what follows: the last cell that may be read. */
template <typename T>
CODEDEXPOSURE_INLINE typename SquareOf<T>::Row
load_last (const T *cell, int width)
{
  constexpr int kSize = SquareOf<T>::kSize;
  T padded[2 * kSize] = {};
  __builtin_memcpy (padded, cell + width - kSize, 16);
  typename SquareOf<T>::Row row;
  __builtin_memcpy (&row, padded + kSize - width, 16);
  return row;
}

/** One vector of cells @p width pixels wide: out[x] + at takes pixel x. Returns
 * the largest pixels. */
template <typename T>
CODEDEXPOSURE_INLINE Vector<T>
split_any (const T *from, int width, T *const *out, int at)
{
  using Row = typename SquareOf<T>::Row;
  constexpr int kSize = SquareOf<T>::kSize;
  const int columns = width < kSize ? width : kSize;
  Row most = {};
  for (int i = 0; i < kLanes<T>; i += kSize) {
    for (int x = 0; x < width; x += kSize) {
      const int pixel = x + columns <= width ? x : width - columns;
      Row square[kSize];
      for (int r = 0; r < kSize; r++) {
        const T *cell = from + (i + r) * width;
        if (width < kSize && i + r == kLanes<T> - 1)
          square[r] = load_last (cell, width);
        else
          __builtin_memcpy (&square[r], cell + pixel, 16);
        most = larger (most, square[r]);
      }
      transpose<T> (square);
      for (int r = 0; r < columns; r++)
        __builtin_memcpy (out[pixel + r] + at + i, &square[r], 16);
    }
  }
  Vector<T> result = {};
  __builtin_memcpy (&result, &most, 16);
  return result;
}

/** One vector of cells, one row of their pixels; Width 0: any. Fetches the row
 * @p ahead bytes further on. Returns the largest pixels. */
template <int Width, typename T, typename PutVector>
CODEDEXPOSURE_INLINE Vector<T>
split_row (const T *from, int width, T *const *out, int at, PutVector put,
    std::ptrdiff_t ahead)
{
  prefetch (bytes_on (from, ahead), (Width > 0 ? Width : width) * kVectorBytes);
  if constexpr (Width == 0) {
    return split_any (from, width, out, at);
  } else {
    Vector<T> parts[Width];
    split_cells<Width, T> (from, parts);
    Vector<T> most = {};
#pragma GCC unroll 256
    for (int x = 0; x < Width; x++) {
      most = larger (most, parts[x]);
      put (out[x] + at, parts[x]);
    }
    return most;
  }
}

/** One vector of cells, Height rows of their pixels from @p row on, a wire for
 * each pixel. Returns the largest pixels, those of @p most among them. */
template <int Width, int Height, typename T>
CODEDEXPOSURE_INLINE Vector<T>
read_cells (const Block<T> &block, const T *row, int at,
    Vector<T> (&wires)[Width * Height], Vector<T> most)
{
#pragma GCC unroll 16
  for (int y = 0; y < Height; y++) {
    const T *from = bytes_on (row, y * block.stride) + at * Width;
    prefetch (
        bytes_on (from, block.height * block.stride), Width * kVectorBytes);
    Vector<T> parts[Width];
    split_cells<Width, T> (from, parts);
#pragma GCC unroll 16
    for (int x = 0; x < Width; x++) {
      wires[y * Width + x] = parts[x];
      most = larger (most, parts[x]);
    }
  }
  return most;
}

/** The function that Own<Width, Height> () gives for cells of this shape: the
 * squarest of 2 to 16 pixels, which fit into the registers. Null for others,
 * and for widths without code of their own. */
template <auto Own>
auto
of_small_cells (int width, int height)
{
  using Run = decltype (Own.template operator()<2, 2> ());
  struct Cell {
    int width, height;
    Run run;
  };
  constexpr auto cell = []<int Width, int Height> () -> Cell {
    if constexpr (has_own_code (Width))
      return {Width, Height, Own.template operator()<Width, Height> ()};
    else
      return {Width, Height, nullptr};
  };
  static constexpr Cell kCells[] = {
      cell.template operator()<2, 1> (),
      cell.template operator()<3, 1> (),
      cell.template operator()<2, 2> (),
      cell.template operator()<5, 1> (),
      cell.template operator()<3, 2> (),
      cell.template operator()<7, 1> (),
      cell.template operator()<4, 2> (),
      cell.template operator()<3, 3> (),
      cell.template operator()<5, 2> (),
      cell.template operator()<4, 3> (),
      cell.template operator()<5, 3> (),
      cell.template operator()<4, 4> (),
  };
  for (const Cell &own : kCells)
    if (own.width == width && own.height == height)
      return own.run;
  return Run (nullptr);
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

} // namespace codedexposure::CODEDEXPOSURE_TARGET

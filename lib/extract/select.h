/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Elements to subframes, as they are. */
#pragma once

#include "base/vector.h"
#include "extract/kernels.h"
#include "extract/split.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/** What Own gives for cells of a width, by Own<Width> (); Own<0> () is for
 * widths that are not split by permutations. */
template <auto Own, int... Width>
auto
for_width (int width, std::integer_sequence<int, Width...>)
{
  static constexpr decltype (Own.template operator()<0> ()) kAll[] = {
      Own.template operator() < has_own_code (Width) ? Width : 0 > ()...};
  return kAll[width <= kOwnWidths ? width : 0];
}
template <auto Own>
auto
for_width (int width)
{
  return for_width<Own> (
      width, std::make_integer_sequence<int, kOwnWidths + 1> ());
}

/** What Own gives for cells of as many rows as columns, if registers hold them
 * as a whole; null: they do not. */
template <auto Own, typename T>
auto
for_square (const Block<T> &block)
{
  return block.width != block.height ? nullptr
         : block.width == 2          ? Own.template operator()<2> ()
         : block.width == 3          ? Own.template operator()<3> ()
         : block.width == 4          ? Own.template operator()<4> ()
                                     : nullptr;
}

/** Calls body (parts, put) for every vector of such cells, where elements stand
 * at one place throughout a row; parts[y][x] are the pixels of a place of them,
 * and put (p, v) writes what place p gives. All pixels of cells are read before
 * anything is written. Returns the largest pixel. */
template <int Width, typename T, typename Body>
CODEDEXPOSURE_INLINE T
for_squares (const Block<T> &block, const Layout<T> &layout,
    const Planes<T> &to, Body body)
{
  constexpr int kN = Width * Width;
  Vector<T> most = {};
  T *out[kN];
  for (int j = 0; j < block.rows; j++) {
    const std::uint8_t *element =
        layout.element + (j + layout.row) % layout.rows * kN;
    for (int p = 0; p < kN; p++)
      out[p] = bytes_on (to.rows[element[p]], j * to.stride);
    for_strips<kLanes<T>> (block.cells, to.stream,
        [&] (int at, Put put) CODEDEXPOSURE_INLINE_BODY {
          const T *row = bytes_on (block.pixels + at * Width,
              std::ptrdiff_t (j) * Width * block.stride);
          Vector<T> parts[Width][Width];
#pragma GCC unroll 4
          for (auto &of_row : parts) {
            prefetch (
                bytes_on (row, Width * block.stride), Width * kVectorBytes);
            split_cells<Width, T> (row, of_row);
            row = bytes_on (row, block.stride);
#pragma GCC unroll 4
            for (const Vector<T> part : of_row)
              most = larger (most, part);
          }
          body (parts, [&] (int p, Vector<T> v)
                           CODEDEXPOSURE_INLINE_BODY { put (out[p] + at, v); });
        });
  }
  return largest_lane<T> (most);
}

/** Kernels::select of such cells. */
template <int Width, typename T>
T
select_squares (
    const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  return for_squares<Width, T> (block, layout, to,
      [&] (const auto &parts, auto put) CODEDEXPOSURE_INLINE_BODY {
#pragma GCC unroll 16
        for (int p = 0; p < Width * Width; p++)
          put (p, parts[p / Width][p % Width]);
      });
}

/** Kernels::select where elements stand at one place throughout a row. All
 * cells of a row are worked on before the next row of their pixels, so that
 * only as many subframes are written at a time: many more than a hundred would
 * be more pages than the TLB of the processor holds. */
template <int Width, typename T>
T
select_rows (
    const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  const int width = Width > 0 ? Width : block.width;
  Vector<T> most = {};
  T *out[256];
  for (int y = 0; y < block.height; y++) {
    int repeat_row = layout.row;
    for (int j = 0; j < block.rows; j++) {
      const std::uint8_t *element =
          layout.element + repeat_row * layout.n + y * width;
      for (int p = 0; p < width; p++)
        out[p] = bytes_on (to.rows[element[p]], j * to.stride);
      repeat_row = repeat_row + 1 < layout.rows ? repeat_row + 1 : 0;
      const T *row = bytes_on (
          block.pixels, (std::ptrdiff_t (j) * block.height + y) * block.stride);
      for_strips<kLanes<T>> (block.cells, to.stream,
          [&] (int at, Put put) CODEDEXPOSURE_INLINE_BODY {
            most =
                larger (most, split_row<Width, T> (row + at * width, width, out,
                                  at, put, block.height * block.stride));
          });
    }
  }
  return largest_lane<T> (most);
}

/** One vector of cells, all places of them: places[p] takes the pixels of place
 * p of the cells from @p at on of row @p j. Returns the largest pixels. */
template <int Width, typename T>
Vector<T>
split_strip (const Block<T> &block, int j, int at, T *const *places)
{
  const int width = Width > 0 ? Width : block.width;
  const T *row =
      bytes_on (block.pixels, std::ptrdiff_t (j) * block.height * block.stride);
  Vector<T> most = {};
  for (int y = 0; y < block.height; y++)
    most = larger (most,
        split_row<Width, T> (bytes_on (row, y * block.stride) + at * width,
            width, places + y * width, 0, Put{false},
            block.height * block.stride));
  return most;
}

/** Kernels::select where the places of elements differ from cell to cell: masks
 * of the comb assemble an element from its places. */
template <typename T>
T
select_relabelled (
    const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  constexpr int kL = kLanes<T>;
  constexpr auto strip = []<int Width> () { return &split_strip<Width, T>; };
  const auto split = for_width<strip> (block.width);
  const int n = layout.n, repeat = layout.repeat;
  alignas (kVectorBytes) T pixels[256 * kL];
  alignas (kVectorBytes) T masks[256 * kL];
  T *places[256];
  for (int p = 0; p < n; p++)
    places[p] = pixels + p * kL;
  Vector<T> most = {};
  for (int j = 0; j < block.rows; j++) {
    const std::uint8_t *place =
        layout.place + (j + layout.row) % layout.rows * n * repeat;
    for_strips<kLanes<T>> (block.cells, to.stream,
        [&] (int at, Put put) CODEDEXPOSURE_INLINE_BODY {
          most = larger (most, split (block, j, at, places));
          for (int c = 0; c < repeat; c++)
            store (masks + c * kL,
                load (
                    layout.comb + (at + layout.column + repeat - c) % repeat));
          for (int e = 0; e < n; e++) {
            Vector<T> v = {};
            for (int c = 0; c < repeat; c++)
              v |= load (masks + c * kL) & load (places[place[e * repeat + c]]);
            put (bytes_on (to.rows[e], j * to.stride) + at, v);
          }
        });
  }
  return largest_lane<T> (most);
}

template <typename T>
T
select (const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  if (layout.repeat > 1)
    return select_relabelled (block, layout, to);
  if (const auto run =
          for_square<[]<int Width> () { return &select_squares<Width, T>; }> (
              block))
    return run (block, layout, to);
  return for_width<[]<int Width> () { return &select_rows<Width, T>; }> (
      block.width) (block, layout, to);
}

/* Vectors of cells that are worked on at a time. */
constexpr int kMostVectors = 64;

CODEDEXPOSURE_INLINE int
most_vectors (int n)
{
  return n * kMostVectors > 256 ? 256 / n : kMostVectors;
}

/** Rows of cells whose elements are split: those of element e are at elements +
 * e pitch, one row after the other. */
template <typename From>
struct Elements {
  const From *at;
  int pitch;
  int cells; ///< of a row
  int rows;
};

/**
 * Splits some cells after the other and calls body (elements, planes): the
 * rows of the planes take those of the elements. Returns the largest pixel.
 */
template <typename T, typename Body>
CODEDEXPOSURE_INLINE T
for_chunks (
    const Block<T> &block, Layout<T> layout, const Planes<T> &to, Body body)
{
  constexpr int kL = kLanes<T>;
  alignas (kVectorBytes) T pixels[256 * kL];
  const int n = layout.n, most = most_vectors (n) * kL, row = layout.row;
  T *rows[256], *out[256];
  T peak = 0;
  for (int next = 0; next < block.cells; next += most) {
    const int left = block.cells - next;
    const int cells = left > most ? most : left > kL ? left : kL;
    const int at = next + cells <= block.cells ? next : block.cells - cells;
    const int together = most / cells;
    layout.column = at;
    for (int j = 0; j < block.rows; j += together) {
      Block<T> part = block;
      part.pixels = bytes_on (block.pixels + at * block.width,
          std::ptrdiff_t (j) * block.height * block.stride);
      part.cells = cells;
      part.rows = block.rows - j < together ? block.rows - j : together;
      layout.row = (row + j) % layout.rows;
      const int pitch = part.rows * cells;
      for (int e = 0; e < n; e++) {
        rows[e] = pixels + e * pitch;
        out[e] = bytes_on (to.rows[e], j * to.stride) + at;
      }
      const T largest = select (
          part, layout, {rows, cells * std::ptrdiff_t (sizeof (T)), false});
      peak = peak < largest ? largest : peak;
      body (Elements<T>{pixels, pitch, cells, part.rows},
          Planes<T>{out, to.stride, to.stream && at == next});
    }
  }
  return peak;
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Elements to subframes, as they are. */
#pragma once

#include "base/vector.h"
#include "extract/kernels.h"
#include "extract/split.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/** Kernels::select where elements stand at one place throughout a row. All
 * cells of a row are worked on before the next Together of their pixel rows, so
 * that only as many subframes are written at a time: many more than a hundred
 * would be more pages than the TLB of the processor holds. Together divides the
 * height of a cell, and 0 stands for all of it; unless it is 1, every element
 * is at the place of its own number. */
template <int Width, int Together, typename T>
T
select_rows (
    const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  const int together = Together > 0 ? Together : block.height;
  const int width = Width > 0 ? Width : block.width;
  Vector<T> most = {};
  T *out[256];
  for (int y = 0; y < block.height; y += together) {
    int repeat_row = layout.row;
    for (int j = 0; j < block.rows; j++) {
      const std::uint8_t *element =
          layout.element + repeat_row * layout.n + y * width;
      for (int p = 0; p < together * width; p++)
        out[p] = bytes_on (
            to.rows[Together == 1 ? element[p] : y * width + p], j * to.stride);
      repeat_row = repeat_row + 1 < layout.rows ? repeat_row + 1 : 0;
      const T *row = bytes_on (
          block.pixels, (std::ptrdiff_t (j) * block.height + y) * block.stride);
      for_strips<T> (block.cells, out[0], to.stream,
          [&] (int at, auto put) CODEDEXPOSURE_INLINE_BODY {
            for (int i = 0; i < together; i++)
              most = larger (most,
                  split_row<Width, T> (
                      bytes_on (row, i * block.stride) + at * width, width,
                      out + i * width, at, put, block.height * block.stride));
          });
    }
  }
  return largest_lane<T> (most);
}

template <typename T>
using SelectRows = T (*) (
    const Block<T> &, const Layout<T> &, const Planes<T> &);

template <int Together, typename T, int... Width>
SelectRows<T>
select_rows_of (int width, std::integer_sequence<int, Width...>)
{
  static constexpr SelectRows<T> kAll[] = {
      select_rows < has_own_code (Width) ? Width : 0, Together, T > ...};
  return kAll[width < int (sizeof...(Width)) ? width : 0];
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
            width, places + y * width, 0, Put (), block.height * block.stride));
  return most;
}

template <typename T>
using SplitStrip = Vector<T> (*) (const Block<T> &, int, int, T *const *);

template <typename T, int... Width>
SplitStrip<T>
split_strip_of (int width, std::integer_sequence<int, Width...>)
{
  static constexpr SplitStrip<T> kAll[] = {
      split_strip < has_own_code (Width) ? Width : 0, T > ...};
  return kAll[width <= kOwnWidths ? width : 0];
}
template <typename T>
SplitStrip<T>
split_strip_of (int width)
{
  return split_strip_of<T> (
      width, std::make_integer_sequence<int, kOwnWidths + 1> ());
}

/** Brings one vector of all places into the order of the elements where that
 * differs from cell to cell: rows[e] takes element e. */
template <typename T, typename PutVector>
CODEDEXPOSURE_INLINE void
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

/** Kernels::select where the places of elements differ from cell to cell. */
template <typename T>
T
select_relabelled (
    const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  const auto split = split_strip_of<T> (block.width);
  Wires<T> wires (layout.n);
  Vector<T> most = {};
  for (int j = 0; j < block.rows; j++)
    for_strips<T> (block.cells, bytes_on (to.rows[0], j * to.stride), to.stream,
        [&] (int at, auto put) CODEDEXPOSURE_INLINE_BODY {
          most = larger (most, split (block, j, at, wires.rows));
          relabel_strip (layout, j, at, wires.rows, to.rows,
              at + j * to.stride / std::ptrdiff_t (sizeof (T)), put);
        });
  return largest_lane<T> (most);
}

template <typename T>
T
select (const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  if (layout.repeat > 1)
    return select_relabelled (block, layout, to);
  /* The work on a row of so few pixels is less than what leads up to it. */
  if (layout.identity && block.width == 2 && block.height == 2)
    return select_rows<2, 2> (block, layout, to);
  /* With non-temporal stores, whole cells are read and written more evenly. */
  if constexpr (kVectorBytes == 64)
    if (layout.identity && to.stream && layout.n <= 16 && block.width <= 5)
      return select_rows_of<0, T> (block.width,
          std::make_integer_sequence<int, 6> ()) (block, layout, to);
  return select_rows_of<1, T> (block.width,
      std::make_integer_sequence<int, kOwnWidths + 1> ()) (block, layout, to);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

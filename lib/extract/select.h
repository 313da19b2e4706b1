/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Elements to subframes, as they are. */
#pragma once

#include "extract/cells.h"
#include "extract/kernels.h"
#include "extract/split.h"
#include "extract/vector.h"

namespace cexp::CEXP_TARGET
{

/** Kernels::select where elements stand at one place throughout a row. One row
 * of all cells after the other, so that only as many subframes are written at a
 * time as a cell is wide: many more than a hundred would be more pages than the
 * processor keeps at hand. */
template <int Width, typename T>
T
select_rows (
    const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  const int width = Width > 0 ? Width : block.width;
  Vector<T> most = {};
  T *out[Width > 0 ? Width : 256];
  for (int y = 0; y < block.height; y++) {
    int repeat_row = layout.row;
    for (int j = 0; j < block.rows; j++) {
      const std::uint8_t *element =
          layout.element + repeat_row * layout.n + y * width;
      for (int x = 0; x < width; x++)
        out[x] = bytes_on (to.rows[element[x]], j * to.stride);
      repeat_row = repeat_row + 1 < layout.rows ? repeat_row + 1 : 0;
      const T *row = bytes_on (
          block.pixels, (std::ptrdiff_t (j) * block.height + y) * block.stride);
      most = larger (most, split_row<Width, T> (row, width, block.cells, out,
                               to.stream, block.height * block.stride));
    }
  }
  return largest_lane<T> (most);
}

/** Kernels::select where the places of elements differ from cell to cell. */
template <typename T>
T
select_relabelled (
    const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  const auto strip = split_strip_of<T> (block.width);
  Wires<T> wires (layout.n);
  Vector<T> most = {};
  for (int j = 0; j < block.rows; j++)
    for_strips<T> (block.cells, bytes_on (to.rows[0], j * to.stride), to.stream,
        [&] (int at, auto put) CEXP_INLINE_BODY {
          most = larger (most, strip (block, j, at, wires.rows));
          relabel_strip (layout, j, at, wires.rows, to.rows,
              at + j * to.stride / std::ptrdiff_t (sizeof (T)), put);
        });
  return largest_lane<T> (most);
}

/** Kernels::select of cells that are in registers. */
struct SelectInRegisters {
  template <int N, typename V, typename PutVector>
  CEXP_INLINE void operator() (V (&wires)[N], PutVector put) const
  {
#pragma GCC unroll 16
    for (int k = 0; k < N; k++)
      put (k, wires[k]);
  }
};

template <typename T>
using SelectRows = T (*) (
    const Block<T> &, const Layout<T> &, const Planes<T> &);

template <typename T, int... Width>
SelectRows<T>
select_rows_of (int width, std::integer_sequence<int, Width...>)
{
  static constexpr SelectRows<T> kAll[] = {select_rows<Width, T>...};
  return kAll[width <= kOwnWidths ? width : 0];
}

template <typename T>
T
select (const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  if (layout.repeat > 1)
    return select_relabelled (block, layout, to);
  /* The work on a row of so few pixels is less than what leads up to it. */
  if (layout.identity && block.width == 2 && block.height == 2)
    return run_in_registers<SelectInRegisters, 2, 2> (block, to, {});
  /* Past the caches, whole cells are read and written more evenly. */
  if (layout.identity && to.stream)
    if (const auto own =
            in_registers<SelectInRegisters, T> (block.width, block.height))
      return own (block, to, {});
  return select_rows_of<T> (block.width, OwnWidths ()) (block, layout, to);
}

} // namespace cexp::CEXP_TARGET

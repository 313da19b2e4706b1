/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rows of elements into rows of slots. Most are plain loops over cells, which
 * the compiler turns into vectors. */
#pragma once

#include "base/vector.h"
#include "extract/kernels.h"
#include "extract/select.h"
#include "extract/split.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/** Sum of all lanes, pairs of lanes added in lanes twice as wide. */
template <typename T>
CODEDEXPOSURE_INLINE std::uint64_t
sum_of_lanes (Vector<T> v)
{
  using Sums = Vector<std::uint64_t>;
  Sums sums = Sums (v);
  if constexpr (sizeof (T) == 1)
    sums = (sums & 0x00ff00ff00ff00ff) + (sums >> 8 & 0x00ff00ff00ff00ff);
  sums = (sums & 0x0000ffff0000ffff) + (sums >> 16 & 0x0000ffff0000ffff);
  sums = (sums & 0xffffffff) + (sums >> 32);
  std::uint64_t sum = 0;
  for (int i = 0; i < kLanes<std::uint64_t>; i++)
    sum += sums[i];
  return sum;
}

template <typename T>
std::uint64_t
count (const T *row, int pixels, T largest)
{
  constexpr int kL = kLanes<T>;
  /* A lane counts its hits as a number of its own type. */
  constexpr int kMostVectors = 255;
  const Vector<T> bound = largest + Vector<T>{};
  std::uint64_t found = 0;
  int x = 0;
  while (x + kL <= pixels) {
    Vector<T> hits = {};
    for (int v = 0; v < kMostVectors && x + kL <= pixels; v++, x += kL)
      hits -= Vector<T> (load (row + x) >= bound);
    found += sum_of_lanes<T> (hits);
  }
  for (; x < pixels; x++)
    found += row[x] >= largest;
  return found;
}

inline void
fence ()
{
#ifdef __SSE2__
  _mm_sfence ();
#endif
}

/** A step from one element to the next, times a gain. */
template <typename T>
struct Step {
  int gain;
  T largest;
  T limit; ///< largest step that the gain leaves in range

  CODEDEXPOSURE_INLINE Vector<T> scaled (Vector<T> step) const
  {
    const Vector<T> bound = limit + Vector<T>{};
    const Vector<T> most = largest + Vector<T>{};
    return step > bound ? most : step * T (gain);
  }
  CODEDEXPOSURE_INLINE Vector<T> operator() (
      Vector<T> now, Vector<T> before) const
  {
    return scaled (larger (now, before) - before);
  }
};

/** Kernels::difference through a buffer. */
template <typename T>
T
difference_any (const Block<T> &block, const Layout<T> &layout, Step<T> step,
    const Planes<T> &to)
{
  const auto split = split_strip_of<T> (block.width);
  Wires<T> places (layout.n), elements (layout.n);
  T *order[256];
  Vector<T> most = {};
  for (int j = 0; j < block.rows; j++) {
    const std::uint8_t *element =
        layout.element + (j + layout.row) % layout.rows * layout.n;
    if (layout.repeat == 1)
      for (int p = 0; p < layout.n; p++)
        order[p] = elements.rows[element[p]];
    const std::ptrdiff_t row = j * to.stride / std::ptrdiff_t (sizeof (T));
    for_strips<T> (block.cells, to.rows[0] + row, to.stream,
        [&] (int at, auto put) CODEDEXPOSURE_INLINE_BODY {
          if (layout.repeat == 1) {
            most = larger (most, split (block, j, at, order));
          } else {
            most = larger (most, split (block, j, at, places.rows));
            relabel_strip (
                layout, j, at, places.rows, elements.rows, 0, Put ());
          }
          Vector<T> before = {};
          for (int k = 0; k < layout.n; k++) {
            const Vector<T> now = load (elements.rows[k]);
            put (to.rows[k] + row + at, step (now, before));
            before = now;
          }
        });
  }
  return largest_lane<T> (most);
}

/** The last elements of one row of all cells: the next row begins with the
 * steps from them. */
template <typename T>
struct LastOfRow {
  static constexpr int kBytes = 8 << 10;
  alignas (64) T elements[kBytes / sizeof (T)];
};

/** Kernels::difference where every element is at the place of its own number,
 * of cells of Height rows; Height 0 stands for any and takes one row of all
 * cells after the other, like select_rows (). Vectors at the end of a row are
 * worked on twice, so that what they start from is kept until the row is over.
 */
template <int Width, int Height, typename T>
T
difference_rows (const Block<T> &block, Step<T> step, const Planes<T> &to)
{
  constexpr int kTogether = Height > 0 ? Height : 1;
  constexpr int kN = kTogether * Width;
  LastOfRow<T> last[2];
  Vector<T> most = {};
  for (int y = 0; y < (Height > 0 ? 1 : block.height); y++) {
    const LastOfRow<T> &above = last[y & 1];
    LastOfRow<T> &here = last[1 - (y & 1)];
    for (int j = 0; j < block.rows; j++) {
      const T *row = bytes_on (
          block.pixels, (std::ptrdiff_t (j) * block.height + y) * block.stride);
      T *out[kN];
      for (int k = 0; k < kN; k++)
        out[k] = bytes_on (to.rows[y * Width + k], j * to.stride);
      for_strips<T> (block.cells, out[0], to.stream,
          [&] (int at, auto put) CODEDEXPOSURE_INLINE_BODY {
            Vector<T> wires[kN];
            most = read_cells<Width, kTogether> (block, row, at, wires, most);
            if (Height == 0 && y > 0)
              put (out[0] + at, step (wires[0], load (above.elements +
                                                      j * block.cells + at)));
            else
              put (out[0] + at, step.scaled (wires[0]));
#pragma GCC unroll 16
            for (int k = 1; k < kN; k++)
              put (out[k] + at, step (wires[k], wires[k - 1]));
            if (Height == 0)
              store (here.elements + j * block.cells + at, wires[kN - 1]);
          });
    }
  }
  return largest_lane<T> (most);
}

template <typename T>
using DifferenceRows = T (*) (const Block<T> &, Step<T>, const Planes<T> &);

template <int Width, typename T>
constexpr DifferenceRows<T>
difference_rows_or_null ()
{
  if constexpr (has_own_code (Width))
    return difference_rows<Width, 0, T>;
  else
    return nullptr;
}

/** Null for cells whose width has no code of its own, and for too many. */
template <typename T, int... Width>
DifferenceRows<T>
difference_rows_of (const Block<T> &block, std::integer_sequence<int, Width...>)
{
  constexpr auto whole_cells = []<int W, int H> () {
    return &difference_rows<W, H, T>;
  };
  if (const auto run = of_small_cells<whole_cells> (block.width, block.height))
    return run;
  static constexpr DifferenceRows<T> kAll[] = {
      difference_rows_or_null<Width, T> ()...};
  const bool fits =
      std::ptrdiff_t (block.cells) * block.rows * std::ptrdiff_t (sizeof (T)) <=
      LastOfRow<T>::kBytes;
  return fits && block.width <= kOwnWidths ? kAll[block.width] : nullptr;
}

template <typename T>
T
difference (const Block<T> &block, const Layout<T> &layout, int gain, T largest,
    const Planes<T> &to)
{
  const Step<T> step = {gain, largest, T (largest / gain)};
  if (layout.identity)
    if (const auto rows = difference_rows_of<T> (
            block, std::make_integer_sequence<int, kOwnWidths + 1> ()))
      return rows (block, step, to);
  return difference_any (block, layout, step, to);
}

/** The element at the centre of the cell, 4 n times as large; @p between has
 * one cell more than @p values at either end. */
template <typename Wide, typename T>
CODEDEXPOSURE_INLINE void
lerp_row (const ElementRow<T> &element, int cells, Wide *__restrict between,
    Wide *__restrict values)
{
  const T *__restrict here = element.here - 1;
  const T *__restrict there = element.there - 1;
  const Wide near_y = Wide (element.y.near), far_y = Wide (element.y.far);
  for (int i = 0; i < cells + 2; i++)
    between[i] = Wide (near_y * here[i] + far_y * there[i]);
  const Wide near_x = Wide (element.x.near), far_x = Wide (element.x.far);
  const Wide *beside = between + 1 + element.step;
  for (int i = 0; i < cells; i++)
    values[i] = Wide (near_x * between[i + 1] + far_x * beside[i]);
}

/** @p Wide holds 4 n times the largest pixel, and 2 more. */
template <typename Wide, typename T>
void
lerp_difference_in (
    const ElementRow<T> *elements, int n, int cells, T largest, T *const *out)
{
  Wide between[kMaxRowCells + 2];
  Wide values[2][kMaxRowCells];
  for (int i = 0; i < cells; i++)
    values[1][i] = 0;
  for (int k = 0; k < n; k++) {
    Wide *__restrict now = values[k & 1];
    const Wide *__restrict before = values[1 - (k & 1)];
    lerp_row (elements[k], cells, between, now);
    T *__restrict to = out[k];
    for (int i = 0; i < cells; i++) {
      const Wide step = Wide (now[i] > before[i] ? now[i] - before[i] : 0);
      const Wide light = Wide ((step + 2) >> 2);
      to[i] = light > largest ? largest : T (light);
    }
  }
}

template <typename T>
void
lerp_difference (
    const ElementRow<T> *elements, int n, int cells, T largest, T *const *out)
{
  if (sizeof (T) == 1 && n <= 64)
    lerp_difference_in<std::uint16_t> (elements, n, cells, largest, out);
  else
    lerp_difference_in<std::uint32_t> (elements, n, cells, largest, out);
}

/** Cells that decode () works on at a time. */
constexpr int kDecodeBlock = 16;

template <typename T>
CODEDEXPOSURE_INLINE void
decode_block (const ElementRow<T> *elements, const TermList *terms, int n,
    int at, int cells, T largest, T *const *out)
{
  double values[256][kDecodeBlock];
  for (int e = 0; e < n; e++) {
    const ElementRow<T> &row = elements[e];
    for (int i = 0; i < cells; i++) {
      const int here =
          row.y.near * row.here[at + i] + row.y.far * row.there[at + i];
      const int beside = row.y.near * row.here[at + i + row.step] +
                         row.y.far * row.there[at + i + row.step];
      values[e][i] = row.x.near * here + row.x.far * beside;
    }
  }
  const double bound = double (largest);
  for (int s = 0; s < n; s++) {
    double light[kDecodeBlock] = {};
    for (int t = 0; t < terms[s].size; t++) {
      const double factor = terms[s].factors[t];
      const double *value = values[terms[s].elements[t]];
      for (int i = 0; i < cells; i++)
        light[i] += factor * value[i];
    }
    for (int i = 0; i < cells; i++) {
      const double up = light[i] + 0.5;
      const double low = up < 0.0 ? 0.0 : up;
      out[s][at + i] = T (int (low > bound ? bound : low));
    }
  }
}

template <typename T>
void
decode (const ElementRow<T> *elements, const TermList *terms, int n, int cells,
    T largest, T *const *out)
{
  int at = 0;
  for (; at + kDecodeBlock <= cells; at += kDecodeBlock)
    decode_block (elements, terms, n, at, kDecodeBlock, largest, out);
  if (at < cells)
    decode_block (elements, terms, n, at, cells - at, largest, out);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

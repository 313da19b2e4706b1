/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Elements to the light of slots: clamped sums of products, of as many cells at
 * a time as two vectors of numbers hold. Linear::pixel () says what is summed.
 */
#pragma once

#include <type_traits>

#include "base/vector.h"
#include "extract/kernels.h"
#include "extract/linear.h"
#include "extract/numbers.h"
#include "extract/select.h"
#include "extract/split.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/** What is the same in all slots of some cells, or of any cells if there is no
 * common factor: sums of fractions where there are any, else of whole numbers.
 */
template <typename Number, bool HasFractions>
struct Starts {
  using Part = std::conditional_t<HasFractions,
      typename Fractions<Number>::Part, Number>;

  static constexpr int kC = kCells<Number>;
  /* Rows are filled up to whole steps. */
  alignas (kVectorBytes) Part parts[2 * kMostVectors * kLanes<std::uint8_t>];
  int steps; ///< of a row; 0: the first one stands for all

  CODEDEXPOSURE_INLINE Part *of (int row, int at)
  {
    return parts + (steps > 0 ? row * steps + (at + kC - 1) / kC : 0) * kC;
  }
  CODEDEXPOSURE_INLINE static void put (Part *to, Two<Vector<Part>> sum)
  {
    store (to, sum.low);
    store (to + kLanes<Part>, sum.high);
  }

  CODEDEXPOSURE_INLINE void add (
      const Linear &linear, Part *to, Two<Vector<Number>> all)
  {
    if constexpr (HasFractions) {
      Fractions<Number> sum (linear);
      sum.add (linear.common, linear.sum_up, all);
      put (to, sum.sum);
    } else {
      Whole<Number> sum (linear.half);
      sum.add (linear.common.whole, all);
      put (to, sum.numbers ());
    }
  }

  template <typename From>
  void fill (const Linear &linear, const Elements<From> &from)
  {
    steps = 0;
    if (!linear.has_common)
      return add (linear, parts, Whole<Number> (0).numbers ());
    steps = (from.cells + kC - 1) / kC;
    for (int j = 0; j < from.rows; j++)
      for_strips<kCells<Number>> (
          from.cells, false, [&] (int at, Put) CODEDEXPOSURE_INLINE_BODY {
            Whole<Number> all (0);
            for (int e = 0; e < linear.n; e++)
              all.add (1, load_cells<Number, From> (
                              from.at + e * from.pitch + j * from.cells + at));
            add (linear, of (j, at), all.numbers ());
          });
  }
};

/** A slot of @p count terms; Count 0: any. */
template <int Count, bool HasFractions, typename T, typename Number,
    typename From>
void
decode_slot (const Linear &decoder, const LinearTerm *first, int count,
    Starts<Number, HasFractions> &starts, const Elements<From> &from, T *out,
    std::ptrdiff_t stride, bool stream)
{
  /* Copies, which pixels that are written cannot change. */
  const Linear linear = decoder;
  const Elements<From> elements = from;
  LinearTerm few[Count > 0 ? Count : 1];
  for (int t = 0; t < Count; t++)
    few[t] = first[t];
  const LinearTerm *terms = Count > 0 ? few : first;
  for (int j = 0; j < elements.rows; j++) {
    const int row = j * elements.cells;
    for_strips<kCells<Number>> (elements.cells, stream,
        [&] (int at, Put put) CODEDEXPOSURE_INLINE_BODY {
          const int cell = row + at;
          const auto *start = starts.of (j, at);
          Whole<Number> whole (0);
          Fractions<Number> rest (linear);
          if constexpr (HasFractions)
            rest = Fractions<Number> (start);
          else
            whole = Whole<Number> (start);
#pragma GCC unroll 2
          for (int t = 0; t < (Count > 0 ? Count : count); t++) {
            const auto numbers = load_cells<Number, From> (
                elements.at + terms[t].value * elements.pitch + cell);
            whole.add (terms[t].whole, numbers);
            if constexpr (HasFractions)
              rest.add (terms[t], linear.up, numbers);
          }
          if constexpr (HasFractions)
            whole.add (1, rest.rounded (linear));
          put_cells<From, T, Number> (
              out + at, light_of (whole, linear), T (linear.largest), put);
        });
    out = bytes_on (out, stride);
  }
}

/** Cells to slots. */
template <bool HasFractions, typename T, typename Number, typename From>
void
decode_cells (
    const Linear &linear, const Elements<From> &from, const Planes<T> &to)
{
  Starts<Number, HasFractions> starts;
  starts.fill (linear, from);
  const LinearTerm *terms = linear.terms;
  for (int s = 0; s < linear.n; s++) {
    const int count = int (linear.terms + linear.ends[s] - terms);
    const auto run = count == 1 ? decode_slot<1, HasFractions, T, Number, From>
                     : count == 2
                         ? decode_slot<2, HasFractions, T, Number, From>
                         : decode_slot<0, HasFractions, T, Number, From>;
    run (linear, terms, count, starts, from, to.rows[s], to.stride, to.stream);
    terms += count;
  }
}

/** Sums in doubles, in the order of the terms. */
template <typename T, typename From>
void
decode_in_doubles (
    const Linear &linear, const Elements<From> &from, const Planes<T> &to)
{
  for (int j = 0; j < from.rows; j++)
    for_strips<kCells<double>> (
        from.cells, false, [&] (int at, Put put) CODEDEXPOSURE_INLINE_BODY {
          const From *values = from.at + j * from.cells + at;
          const LinearTerm *term = linear.terms;
          for (int s = 0; s < linear.n; s++) {
            const LinearTerm *const end = linear.terms + linear.ends[s];
            Two<Vector<double>> light = {};
            for (; term < end; term++) {
              const auto numbers =
                  load_cells<double, From> (values + term->value * from.pitch);
              light.low += term->factor * numbers.low;
              light.high += term->factor * numbers.high;
            }
            light = {light.low + 0.5, light.high + 0.5};
            put_cells<From, T, double> (
                bytes_on (to.rows[s], j * to.stride) + at, light,
                T (linear.largest), put);
          }
        });
}

template <typename T, typename Number, typename From>
CODEDEXPOSURE_INLINE void
decode_cells_in (
    const Linear &linear, const Elements<From> &from, const Planes<T> &to)
{
  if constexpr (std::is_same_v<Number, double>)
    decode_in_doubles (linear, from, to);
  else if (linear.has_fractions)
    decode_cells<true, T, Number> (linear, from, to);
  else
    decode_cells<false, T, Number> (linear, from, to);
}

/** Kernels::decode. */
template <typename T, typename Number>
T
decode_in (const Block<T> &block, const Layout<T> &layout, const Linear &linear,
    const Planes<T> &to)
{
  return for_chunks (
      block, layout, to, [&] (const Elements<T> &from, const Planes<T> &out) {
        decode_cells_in<T, Number> (linear, from, out);
      });
}

/** Kernels::decode of Linear::is_one_hot, where registers hold cells. */
template <int Width, typename T>
T
decode_one_hot (const Block<T> &block, const Layout<T> &layout,
    const Linear &decoder, const Planes<T> &to)
{
  using Number = NumberOf<T>;
  constexpr int kN = Width * Width;
  const Linear linear = decoder; // pixels that are written cannot change it
  const LinearTerm term = linear.terms[0];
  T *of_element[kN];
  for (int s = 0; s < kN; s++)
    of_element[linear.terms[s].value] = to.rows[s];
  return for_squares<Width, T> (block, layout,
      {of_element, to.stride, to.stream},
      [&] (const auto &parts, auto put) CODEDEXPOSURE_INLINE_BODY {
        Whole<Number> all (0);
#pragma GCC unroll 16
        for (int p = 0; p < kN; p++)
          all.add (1, numbers_of<Number, T> (parts[p / Width][p % Width]));
        Fractions<Number> start (linear);
        start.add (linear.common, linear.sum_up, all.numbers ());
#pragma GCC unroll 16
        for (int p = 0; p < kN; p++) {
          const auto numbers =
              numbers_of<Number, T> (parts[p / Width][p % Width]);
          Whole<Number> whole (0);
          whole.add (term.whole, numbers);
          auto rest = start;
          rest.add (term, linear.up, numbers);
          whole.add (1, rest.rounded (linear));
          const auto light = light_of (whole, linear);
          put (p, packed_clamped<T, Number> (
                      light.low, light.high, T (linear.largest)));
        }
      });
}

/** One element less another one, times a factor. */
template <typename T>
struct Difference {
  Vector<T> most, limit;
  std::uint16_t factor;

  CODEDEXPOSURE_INLINE explicit Difference (const Linear &linear)
      : most (T (linear.largest) + Vector<T>{}),
        limit (T (linear.largest / linear.terms[0].whole) + Vector<T>{}),
        factor (std::uint16_t (linear.terms[0].whole))
  {
  }

  CODEDEXPOSURE_INLINE Vector<T> operator() (
      Vector<T> element, Vector<T> before) const
  {
    const Vector<T> step = larger (element, before) - before;
    /* No product is larger than a pixel, so those of two bytes are one of 16
     * bits. */
    const auto product = Vector<std::uint16_t> (smaller (step, limit)) * factor;
    return step > limit ? most : Vector<T> (product);
  }
};

/** Kernels::decode where slot k is element k less the one before, and every
 * element is at the place of its own number; registers hold cells. */
template <int Width, typename T>
T
decode_square_differences (const Block<T> &block, const Layout<T> &layout,
    const Linear &linear, const Planes<T> &to)
{
  const Difference<T> difference (linear);
  return for_squares<Width, T> (block, layout, to,
      [&] (const auto &parts, auto put) CODEDEXPOSURE_INLINE_BODY {
        Vector<T> before = {};
#pragma GCC unroll 16
        for (int p = 0; p < Width * Width; p++) {
          const Vector<T> part = parts[p / Width][p % Width];
          put (p, difference (part, before));
          before = part;
        }
      });
}

/** The same for other cells. */
template <int Width, typename T>
T
decode_differences (
    const Block<T> &block, const Linear &linear, const Planes<T> &to)
{
  const Difference<T> difference (linear);
  Vector<T> most = {};
  T *out[256];
  for (int j = 0; j < block.rows; j++) {
    for (int k = 0; k < Width * block.height; k++)
      out[k] = bytes_on (to.rows[k], j * to.stride);
    for_strips<kLanes<T>> (block.cells, to.stream,
        [&] (int at, Put put) CODEDEXPOSURE_INLINE_BODY {
          Vector<T> before = {};
          const T *row = bytes_on (block.pixels + at * Width,
              std::ptrdiff_t (j) * block.height * block.stride);
          for (int y = 0; y < block.height; y++) {
            prefetch (bytes_on (row, block.height * block.stride),
                Width * kVectorBytes);
            Vector<T> parts[Width];
            split_cells<Width, T> (row, parts);
#pragma GCC unroll 16
            for (int x = 0; x < Width; x++) {
              put (out[y * Width + x] + at, difference (parts[x], before));
              before = parts[x];
              most = larger (most, before);
            }
            row = bytes_on (row, block.stride);
          }
        });
  }
  return largest_lane<T> (most);
}

template <typename T>
using DecodeDifferences = T (*) (
    const Block<T> &, const Linear &, const Planes<T> &);

/** The element at the centre of the cell, 4 n times as large. */
template <typename T, typename Number>
void
interpolate (const ElementRow<T> &row, int at, int cells, Number *values)
{
  const T *here = row.here + at, *there = row.there + at;
  const T *here_beside = here + row.step, *there_beside = there + row.step;
  for (int i = 0; i < cells; i++)
    values[i] =
        Number (row.here_near * here[i] + row.here_far * here_beside[i] +
                row.there_near * there[i] + row.there_far * there_beside[i]);
}

/** Kernels::decode_row. */
template <typename T, typename Number>
void
decode_row_in (const ElementRow<T> *elements, const Linear &linear, int cells,
    T *const *out)
{
  constexpr int kC = kCells<Number>;
  alignas (kVectorBytes) Number values[256 * kC];
  T *to[256];
  const int most = most_vectors (linear.n) * kC;
  for (int next = 0; next < cells; next += most) {
    const int left = cells - next;
    const int count = left > most ? most : left > kC ? left : kC;
    const int at = next + count <= cells ? next : cells - count;
    for (int e = 0; e < linear.n; e++) {
      interpolate (elements[e], at, count, values + e * count);
      to[e] = out[e] + at;
    }
    decode_cells_in<T, Number> (linear,
        Elements<Number>{values, count, count, 1}, Planes<T>{to, 0, false});
  }
}

template <typename T>
T
decode (const Block<T> &block, const Layout<T> &layout, const Linear &linear,
    const Planes<T> &to)
{
  constexpr auto differences = []<int Width> () -> DecodeDifferences<T> {
    if constexpr (Width > 0)
      return &decode_differences<Width, T>;
    return nullptr;
  };
  constexpr auto square_differences = []<int Width> () {
    return &decode_square_differences<Width, T>;
  };
  constexpr auto one_hot = []<int Width> () {
    return &decode_one_hot<Width, T>;
  };
  if (linear.is_staircase && layout.identity) {
    if (const auto run = for_square<square_differences> (block))
      return run (block, layout, linear, to);
    if (const auto run = for_width<differences> (block.width))
      return run (block, linear, to);
  }
  constexpr Numbers kNumbers =
      sizeof (T) == 1 ? Numbers::kShort : Numbers::kInt;
  if (linear.is_one_hot && linear.numbers == kNumbers && layout.repeat == 1)
    if (const auto run = for_square<one_hot> (block))
      return run (block, layout, linear, to);
  if constexpr (sizeof (T) == 1)
    if (linear.numbers == Numbers::kShort)
      return decode_in<T, short> (block, layout, linear, to);
  return linear.numbers == Numbers::kDouble
             ? decode_in<T, double> (block, layout, linear, to)
             : decode_in<T, int> (block, layout, linear, to);
}

template <typename T>
void
decode_row (const ElementRow<T> *elements, const Linear &linear, int cells,
    T *const *out)
{
  if constexpr (sizeof (T) == 1)
    if (linear.numbers == Numbers::kShort)
      return decode_row_in<T, short> (elements, linear, cells, out);
  return linear.numbers == Numbers::kDouble
             ? decode_row_in<T, double> (elements, linear, cells, out)
             : decode_row_in<T, int> (elements, linear, cells, out);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

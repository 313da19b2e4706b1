/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Elements to the light of slots: clamped sums of products, of as many cells at
 * a time as two vectors of numbers hold. Linear::pixel () says what is summed.
 */
#pragma once

#include <type_traits>

#include "base/vector.h"
#include "extract/kernels.h"
#include "extract/linear.h"
#include "extract/select.h"
#include "extract/split.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/* Vectors of wider numbers have the order of the halves of 16 bytes, which
 * every instruction set unpacks and packs at once. */

/** The lower (Half = 0) or upper halves of 16 bytes, with another vector's. */
template <int Lanes, int Together, int Half>
struct Unpack {
  static constexpr int at (int lane)
  {
    const int within = lane % Together;
    return lane - within + within / 2 + Half * Together / 2 +
           within % 2 * Lanes;
  }
};

/** Every second lane of 16 bytes of one vector and of another one. */
template <int Lanes, int Together>
struct Pack {
  static constexpr int at (int lane)
  {
    const int within = lane % Together, half = Together / 2;
    return lane - within + within % half * 2 + (within < half ? 0 : Lanes);
  }
};

template <typename Wide, int Half, typename T>
CODEDEXPOSURE_INLINE Vector<Wide>
unpacked (Vector<T> v)
{
  return Vector<Wide> (
      pick (v, Vector<T>{}, Unpack<kLanes<T>, 16 / int (sizeof (T)), Half> (),
          std::make_integer_sequence<int, kLanes<T>> ()));
}

template <typename T, typename Wide>
CODEDEXPOSURE_INLINE Vector<T>
packed (Vector<Wide> low, Vector<Wide> high)
{
  return pick (Vector<T> (low), Vector<T> (high),
      Pack<kLanes<T>, 16 / int (sizeof (T))> (),
      std::make_integer_sequence<int, kLanes<T>> ());
}

template <typename Number>
CODEDEXPOSURE_INLINE Vector<Number>
clamped (Vector<Number> light, Number largest)
{
  return smaller (larger (light, Vector<Number>{}), largest + Vector<Number>{});
}

/** The same, clamped to 0..largest. */
template <typename T, typename Wide>
CODEDEXPOSURE_INLINE Vector<T>
packed_clamped (Vector<Wide> low, Vector<Wide> high, T largest)
{
#if CODEDEXPOSURE_VECTOR_BYTES == 64
  using Raw = __m512i;
  constexpr auto pack = [] (Raw a, Raw b) CODEDEXPOSURE_INLINE_BODY {
    return sizeof (T) == 1 ? _mm512_packus_epi16 (a, b)
                           : _mm512_packus_epi32 (a, b);
  };
#elif CODEDEXPOSURE_VECTOR_BYTES == 32
  using Raw = __m256i;
  constexpr auto pack = [] (Raw a, Raw b) CODEDEXPOSURE_INLINE_BODY {
    return sizeof (T) == 1 ? _mm256_packus_epi16 (a, b)
                           : _mm256_packus_epi32 (a, b);
  };
#elif defined __SSE4_1__
  using Raw = __m128i;
  constexpr auto pack = [] (Raw a, Raw b) CODEDEXPOSURE_INLINE_BODY {
    return sizeof (T) == 1 ? _mm_packus_epi16 (a, b) : _mm_packus_epi32 (a, b);
  };
#else
  using Raw = Vector<Wide>;
  constexpr auto pack = [] (Raw a, Raw b) CODEDEXPOSURE_INLINE_BODY {
    constexpr Wide kMost = Wide (T (-1));
    return packed<T, Wide> (clamped<Wide> (a, kMost), clamped<Wide> (b, kMost));
  };
#endif
  return smaller (
      Vector<T> (pack (Raw (low), Raw (high))), largest + Vector<T>{});
}

/** Cells of which the light is computed at a time. */
template <typename Number>
constexpr int kCells = 2 * kLanes<Number>;

/** Numbers of so many cells. */
template <typename V>
struct Two {
  V low, high;

  CODEDEXPOSURE_INLINE static Two of (V both) { return {both, both}; }
};

/** The numbers of cells; values are not negative. */
template <typename Number, typename From>
CODEDEXPOSURE_INLINE Two<Vector<Number>>
load_cells (const From *from)
{
  if constexpr (sizeof (Number) == 2 * sizeof (From)) {
    const Vector<From> v = load (from);
    return {unpacked<Number, 0, From> (v), unpacked<Number, 1, From> (v)};
  } else {
    Number numbers[kCells<Number>];
    for (int i = 0; i < kCells<Number>; i++)
      numbers[i] = Number (from[i]);
    return {load (numbers), load (numbers + kLanes<Number>)};
  }
}

/** The pixels of cells. */
template <typename From, typename T, typename Number>
CODEDEXPOSURE_INLINE void
put_cells (
    T *to, Two<Vector<Number>> light, T largest, [[maybe_unused]] Put put)
{
  if constexpr (sizeof (Number) == 2 * sizeof (From)) {
    put (to, packed_clamped<T, Number> (light.low, light.high, largest));
  } else {
    Number numbers[kCells<Number>];
    store (numbers, light.low);
    store (numbers + kLanes<Number>, light.high);
    for (int i = 0; i < kCells<Number>; i++) {
      const Number low = numbers[i] < 0 ? 0 : numbers[i];
      to[i] = T (int (low > largest ? largest : low));
    }
  }
}

/** Sums of whole numbers wrap around; only the last one has to fit. */
template <typename Number>
using Wrapping = Vector<std::make_unsigned_t<Number>>;

/** Sums of whole multiples. */
template <typename Number>
struct Whole {
  Two<Wrapping<Number>> sum;

  CODEDEXPOSURE_INLINE explicit Whole (int start)
      : sum (Two<Wrapping<Number>>::of (
            std::make_unsigned_t<Number> (start) + Wrapping<Number>{}))
  {
  }
  CODEDEXPOSURE_INLINE explicit Whole (const Number *from)
      : sum{Wrapping<Number> (load (from)),
            Wrapping<Number> (load (from + kLanes<Number>))}
  {
  }

  CODEDEXPOSURE_INLINE Two<Vector<Number>> numbers () const
  {
    return {Vector<Number> (sum.low), Vector<Number> (sum.high)};
  }

  CODEDEXPOSURE_INLINE void add (int factor, Two<Vector<Number>> values)
  {
    const auto times = std::make_unsigned_t<Number> (factor);
    if (factor == 1) [[likely]] {
      sum.low += Wrapping<Number> (values.low);
      sum.high += Wrapping<Number> (values.high);
    } else if (factor != 0) {
      sum.low += times * Wrapping<Number> (values.low);
      sum.high += times * Wrapping<Number> (values.high);
    }
  }
};

/** Sums of fractions: floats, or numbers of 16 bits. */
template <typename Number>
struct Fractions {
  using Part = float;

  Two<Vector<Part>> sum;

  CODEDEXPOSURE_INLINE explicit Fractions (const Linear &linear)
      : sum (Two<Vector<Part>>::of (linear.start + Vector<Part>{}))
  {
  }
  CODEDEXPOSURE_INLINE explicit Fractions (const Part *from)
      : sum{load (from), load (from + kLanes<Part>)}
  {
  }

  CODEDEXPOSURE_INLINE void add (
      const LinearTerm &term, int, Two<Vector<Number>> values)
  {
    sum.low +=
        term.fraction * __builtin_convertvector(values.low, Vector<float>);
    sum.high +=
        term.fraction * __builtin_convertvector(values.high, Vector<float>);
  }

  CODEDEXPOSURE_INLINE Two<Vector<Number>> rounded (const Linear &) const
  {
    return {rounded (sum.low), rounded (sum.high)};
  }

private:
  /* A small float becomes one whose lower bits are it, rounded to nearest. */
  CODEDEXPOSURE_INLINE static Vector<int> rounded (Vector<float> v)
  {
    return Vector<int> (v + 12582912.0f) - 0x4b400000; // 1.5 * 2^23
  }
};

/** The upper halves of products. */
CODEDEXPOSURE_INLINE Vector<short>
high_product (Vector<short> values, short factor)
{
  short products[kLanes<short>];
  store (products, values);
  for (short &product : products)
    product = short (int (product) * int (factor) >> 16);
  return load (products);
}

template <>
struct Fractions<short> {
  using Part = std::uint16_t;

  Two<Vector<Part>> sum;

  CODEDEXPOSURE_INLINE explicit Fractions (const Linear &linear)
      : sum (Two<Vector<Part>>::of (Part (linear.high_start) + Vector<Part>{}))
  {
  }
  CODEDEXPOSURE_INLINE explicit Fractions (const Part *from)
      : sum{load (from), load (from + kLanes<Part>)}
  {
  }

  CODEDEXPOSURE_INLINE void add (
      const LinearTerm &term, int up, Two<Vector<short>> values)
  {
    sum.low += Vector<Part> (high_product (values.low << up, term.high));
    sum.high += Vector<Part> (high_product (values.high << up, term.high));
  }

  CODEDEXPOSURE_INLINE Two<Vector<short>> rounded (const Linear &linear) const
  {
    return {Vector<short> (sum.low) >> linear.down,
        Vector<short> (sum.high) >> linear.down};
  }
};

/** Calls body (at, put) for all cells, kCells at a time. */
template <typename Number, typename Body>
CODEDEXPOSURE_INLINE void
for_cells (int cells, bool stream, Body body)
{
  constexpr int kC = kCells<Number>;
  int at = 0;
  for (; at + kC <= cells; at += kC)
    body (at, Put{stream});
  if (at < cells)
    body (cells - kC, Put{false});
}

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
      for_cells<Number> (
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
    for_cells<Number> (elements.cells, stream,
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
          auto light = whole.numbers ();
          if (linear.shift > 0)
            light = {light.low >> linear.shift, light.high >> linear.shift};
          put_cells<From, T, Number> (out + at, light, T (linear.largest), put);
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
    for_cells<double> (
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

/** One element less another one, times a factor. */
template <typename T>
struct Difference {
  Vector<T> most, limit;
  std::uint16_t factor;

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
 * element is at the place of its own number; Height 0: any. */
template <int Width, typename T, int Height = 0>
T
decode_differences (
    const Block<T> &block, const Linear &linear, const Planes<T> &to)
{
  /* Registers hold small cells as a whole. */
  if constexpr (Height == 0 && Width <= 4)
    if (block.height == Width)
      return decode_differences<Width, T, Width> (block, linear, to);
  const int height = Height > 0 ? Height : block.height;
  const int factor = linear.terms[0].whole;
  const Difference<T> difference = {T (linear.largest) + Vector<T>{},
      T (linear.largest / factor) + Vector<T>{}, std::uint16_t (factor)};
  Vector<T> most = {};
  T *out[Height > 0 ? Width * Height : 256];
  for (int j = 0; j < block.rows; j++) {
    for (int k = 0; k < Width * height; k++)
      out[k] = bytes_on (to.rows[k], j * to.stride);
    for_strips<T> (block.cells, to.stream,
        [&] (int at, Put put) CODEDEXPOSURE_INLINE_BODY {
          Vector<T> before = {};
          const T *row = bytes_on (block.pixels + at * Width,
              std::ptrdiff_t (j) * height * block.stride);
          const auto split = [&] (int y) CODEDEXPOSURE_INLINE_BODY {
            prefetch (
                bytes_on (row, height * block.stride), Width * kVectorBytes);
            Vector<T> parts[Width];
            split_cells<Width, T> (row, parts);
#pragma GCC unroll 16
            for (int x = 0; x < Width; x++) {
              put (out[y * Width + x] + at, difference (parts[x], before));
              before = parts[x];
              most = larger (most, before);
            }
            row = bytes_on (row, block.stride);
          };
          if constexpr (Height > 0) {
#pragma GCC unroll 4
            for (int y = 0; y < Height; y++)
              split (y);
          } else {
            for (int y = 0; y < height; y++)
              split (y);
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
  if (linear.is_staircase && layout.identity)
    if (const auto run = for_width<differences> (block.width))
      return run (block, linear, to);
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

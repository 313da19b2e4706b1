/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Vectors of the numbers in which the light of slots is summed, and pixels of
 * them: of as many cells at a time as two vectors hold. */
#pragma once

#include <type_traits>

#include "base/vector.h"
#include "extract/linear.h"
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

/** The numbers of the pixels of two vectors' worth of cells. */
template <typename T>
using NumberOf = std::conditional_t<sizeof (T) == 1, short, int>;

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
numbers_of (Vector<From> v)
{
  return {unpacked<Number, 0, From> (v), unpacked<Number, 1, From> (v)};
}

/** The same from memory. */
template <typename Number, typename From>
CODEDEXPOSURE_INLINE Two<Vector<Number>>
load_cells (const From *from)
{
  if constexpr (sizeof (Number) == 2 * sizeof (From)) {
    return numbers_of<Number, From> (load (from));
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

/** Of sums that are complete. */
template <typename Number>
CODEDEXPOSURE_INLINE Two<Vector<Number>>
light_of (const Whole<Number> &whole, const Linear &linear)
{
  const auto light = whole.numbers ();
  if (linear.shift > 0)
    return {light.low >> linear.shift, light.high >> linear.shift};
  return light;
}

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

} // namespace codedexposure::CODEDEXPOSURE_TARGET

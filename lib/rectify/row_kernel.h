/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Sums over the pixels of windows; see base/vector.h for what it may call. */
#pragma once

#include "base/vector.h"
#include "rectify/kernels.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/* Explicit vectors, as the compiler does not vectorise plain loops here; of the
 * same width everywhere, so that sums round alike. */
typedef float Four __attribute__ ((vector_size (16)));
typedef float Eight __attribute__ ((vector_size (32)));

#ifdef __AVX2__

CODEDEXPOSURE_INLINE Eight
load_eight (const std::uint16_t *from)
{
  const __m128i n = _mm_loadu_si128 (reinterpret_cast<const __m128i *> (from));
  return _mm256_cvtepi32_ps (_mm256_cvtepu16_epi32 (n));
}

CODEDEXPOSURE_INLINE Eight
load_eight (const std::uint8_t *from)
{
  const __m128i n = _mm_loadl_epi64 (reinterpret_cast<const __m128i *> (from));
  return _mm256_cvtepi32_ps (_mm256_cvtepu8_epi32 (n));
}

#else

typedef std::uint8_t Bytes __attribute__ ((vector_size (8)));
typedef std::uint16_t Words __attribute__ ((vector_size (16)));

CODEDEXPOSURE_INLINE Eight
to_floats (Words n)
{
  typedef std::int32_t Ints __attribute__ ((vector_size (16)));
  const Four low = __builtin_convertvector(
      __builtin_convertvector(__builtin_shufflevector (n, n, 0, 1, 2, 3), Ints),
      Four);
  const Four high = __builtin_convertvector(
      __builtin_convertvector(__builtin_shufflevector (n, n, 4, 5, 6, 7), Ints),
      Four);
  return __builtin_shufflevector (low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}

CODEDEXPOSURE_INLINE Eight
load_eight (const std::uint16_t *from)
{
  Words n;
  __builtin_memcpy (&n, from, sizeof n);
  return to_floats (n);
}

CODEDEXPOSURE_INLINE Eight
load_eight (const std::uint8_t *from)
{
  Bytes n;
  __builtin_memcpy (&n, from, sizeof n);
  return to_floats (__builtin_convertvector(n, Words));
}

#endif

CODEDEXPOSURE_INLINE float
sum_of (Four v)
{
  return (v[0] + v[1]) + (v[2] + v[3]);
}

template <int First>
CODEDEXPOSURE_INLINE Four
four_of (Eight v)
{
  return __builtin_shufflevector (v, v, First, First + 1, First + 2, First + 3);
}

/** kTaps x kTaps pixels, row by row. */
template <int kTaps>
struct Window {
  Eight rows[kTaps];
  Four rest[kTaps]; ///< of each row, beyond eight

  template <typename Pixel>
  CODEDEXPOSURE_INLINE void read (const Pixel *from, std::ptrdiff_t stride)
  {
    for (int y = 0; y < kTaps; y++) {
      rows[y] = load_eight (from);
      if constexpr (kTaps > 8)
        rest[y] = four_of<0> (load_eight (from + 8));
      from = reinterpret_cast<const Pixel *> (
          reinterpret_cast<const char *> (from) + stride);
    }
  }

  /** Mean squared difference of neighbours among the central 5 x 5 pixels. */
  CODEDEXPOSURE_INLINE float roughness () const
  {
    constexpr int kFirst = kTaps / 2 - 2, kSteps = 4;
    Four across = {}, down = {};
    for (int y = kFirst; y < kFirst + kSteps; y++) {
      const Four here = four_of<kFirst> (rows[y]);
      const Four below = four_of<kFirst> (rows[y + 1]);
      const Four right = four_of<kFirst + 1> (rows[y]);
      across += (right - here) * (right - here);
      down += (below - here) * (below - here);
    }
    return sum_of (across + down) / (2 * kSteps * kSteps);
  }

  /** @p weights: see Filters. */
  CODEDEXPOSURE_INLINE float filtered (const float *weights) const
  {
    Eight sum = {};
    Four beyond = {};
    for (int y = 0; y < kTaps; y++, weights += rectify::row_length (kTaps)) {
      Eight w;
      __builtin_memcpy (&w, weights, sizeof w);
      sum += w * rows[y];
      if constexpr (kTaps > 8) {
        Four v;
        __builtin_memcpy (&v, weights + 8, sizeof v);
        beyond += v * rest[y];
      }
    }
    Four half = four_of<0> (sum) + four_of<4> (sum);
    if constexpr (kTaps > 8)
      half += beyond;
    return sum_of (half);
  }
};

/** RectifyRow. */
template <int kTaps, typename Pixel>
void
rectify_row (const rectify::Source<Pixel> &from, const rectify::Place *places,
    int count, const rectify::Filters &filters, Pixel *to, float *errors)
{
  using rectify::kNoises, rectify::kRead;
  const float to_noise = 0.5f / filters.noise;
  Pixel copy[kTaps * kRead] = {};
  for (int x = 0; x < count; x++) {
    const rectify::Place &place = places[x];
    const Pixel *first = reinterpret_cast<const Pixel *> (
                             reinterpret_cast<const char *> (from.first) +
                             place.y * from.stride) +
                         place.x;
    if (place.filter < 0) {
      to[x] = place.filter == rectify::Place::kLookup ? *first : Pixel (0);
      if (errors)
        errors[x] = 0.0f;
      continue;
    }
    std::ptrdiff_t stride = from.stride;
    if (place.x + kRead > from.width) {
      for (int y = 0; y < kTaps; y++)
        __builtin_memcpy (copy + y * kRead,
            reinterpret_cast<const char *> (first) + y * stride,
            kTaps * sizeof (Pixel));
      first = copy;
      stride = std::ptrdiff_t (kRead * sizeof (Pixel));
    }
    Window<kTaps> window;
    window.read (first, stride);
    /* Differences beyond the noise are the scene's. */
    float scene = 0.0f;
    std::ptrdiff_t filter = std::ptrdiff_t (place.filter) * kNoises;
    if (filters.scales) {
      const rectify::WindowScale &scale = filters.scales[place.filter];
      scene = (window.roughness () * to_noise * scale.darkness - 1.0f) *
              scale.smoothness;
      for (const float limit : filters.limits)
        filter += scene <= limit;
    }
    const float sum = window.filtered (
        filters.weights + filter * kTaps * rectify::row_length (kTaps));
    const float rounded = sum + 0.5f;
    to[x] = Pixel (std::int32_t (rounded < 0.0f              ? 0.0f
                                 : rounded > filters.largest ? filters.largest
                                                             : rounded));
    if (errors) {
      const rectify::FilterError &error = filters.errors[filter];
      errors[x] = __builtin_sqrtf (
          filters.noise *
          ((scene > 0.0f ? scene : 0.0f) * error.scene + error.noise));
    }
  }
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

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

template <int First>
CODEDEXPOSURE_INLINE Four
four_of (Eight v)
{
  return __builtin_shufflevector (v, v, First, First + 1, First + 2, First + 3);
}

/** Where the first pixel of a window is, and the next row, in bytes. */
template <typename Pixel>
struct Corner {
  const Pixel *first;
  std::ptrdiff_t stride;

  CODEDEXPOSURE_INLINE const Pixel *row (int y) const
  {
    return reinterpret_cast<const Pixel *> (
        reinterpret_cast<const char *> (first) + y * stride);
  }
};

/** Of blocks whose first pixels are eight of a row: the differences of a column
 * each. */
template <typename Pixel>
CODEDEXPOSURE_INLINE Eight
columns_at (const Corner<Pixel> &at)
{
  Eight across = {}, down = {}, here = load_eight (at.row (0));
  for (int y = 0; y < rectify::kSteps; y++) {
    const Eight below = load_eight (at.row (y + 1));
    const Eight right = load_eight (at.row (y) + 1);
    across += (right - here) * (right - here);
    down += (below - here) * (below - here);
    here = below;
  }
  return across + down;
}

/** The same near the end of a row, of which @p width pixels are left. */
template <typename Pixel>
CODEDEXPOSURE_INLINE Eight
last_columns_at (const Corner<Pixel> &at, int width)
{
  constexpr int kCopied = 9;
  Pixel copy[(rectify::kSteps + 1) * kCopied] = {};
  for (int y = 0; y <= rectify::kSteps; y++)
    for (int x = 0; x < width; x++)
      copy[y * kCopied + x] = at.row (y)[x];
  return columns_at (Corner<Pixel>{copy, kCopied * sizeof (Pixel)});
}

/** MeasureRow. */
template <typename Pixel>
void
measure_row (const rectify::Source<Pixel> &from, int count, float *to)
{
  constexpr int kLength = 128, kColumns = kLength + 8;
  float columns[kColumns];
  for (int x = 0; x < count; x += kLength) {
    const int some = count - x < kLength ? count - x : kLength;
    for (int i = 0; i < some + rectify::kSteps - 1; i += 8) {
      const Corner<Pixel> at{from.first + x + i, from.stride};
      const int left = from.width - x - i;
      const Eight eight =
          left > 8 ? columns_at (at) : last_columns_at (at, left);
      __builtin_memcpy (columns + i, &eight, sizeof eight);
    }
    for (int i = 0; i < some; i++)
      to[x + i] =
          (columns[i] + columns[i + 1]) + (columns[i + 2] + columns[i + 3]);
  }
}

/** kTaps x kTaps pixels. */
template <int kTaps, typename Pixel>
struct Window {
  Corner<Pixel> at;

  /** Four parts of the sum. @p weights: see Filters. */
  CODEDEXPOSURE_INLINE Four filtered (const float *weights) const
  {
    Eight sum = {};
    Four beyond = {};
    for (int y = 0; y < kTaps; y++, weights += rectify::row_length (kTaps)) {
      Eight w;
      __builtin_memcpy (&w, weights, sizeof w);
      sum += w * load_eight (at.row (y));
      if constexpr (kTaps > 8) {
        Four v;
        __builtin_memcpy (&v, weights + 8, sizeof v);
        beyond += v * four_of<0> (load_eight (at.row (y) + 8));
      }
    }
    Four half = four_of<0> (sum) + four_of<4> (sum);
    if constexpr (kTaps > 8)
      half += beyond;
    return half;
  }
};

/** Windows of a row of mirrors. */
template <int kTaps, typename Pixel>
class Windows
{
public:
  CODEDEXPOSURE_INLINE explicit Windows (const rectify::Source<Pixel> &from)
      : from_ (from)
  {
  }
  CODEDEXPOSURE_INLINE Corner<Pixel> corner (const rectify::Place &place) const
  {
    const auto *row =
        reinterpret_cast<const char *> (from_.first) + place.y * from_.stride;
    return {reinterpret_cast<const Pixel *> (row) + place.x, from_.stride};
  }
  /** Valid until the next call. */
  CODEDEXPOSURE_INLINE Window<kTaps, Pixel> of (const rectify::Place &place)
  {
    const Corner<Pixel> at = corner (place);
    if (place.x + rectify::kRead <= from_.width)
      return {at};
    for (int y = 0; y < kTaps; y++)
      __builtin_memcpy (
          copy_ + y * rectify::kRead, at.row (y), kTaps * sizeof (Pixel));
    return {{copy_, std::ptrdiff_t (rectify::kRead * sizeof (Pixel))}};
  }

private:
  const rectify::Source<Pixel> &from_;
  Pixel copy_[kTaps * rectify::kRead] = {};
};

/** Some mirrors of a row. Each step is taken for all of them before the next
 * one, so that the processor need not wait for the result of any. */
template <int kTaps, typename Pixel>
class Mirrors
{
public:
  static constexpr int kMost = 64;

  CODEDEXPOSURE_INLINE
  Mirrors (const rectify::Source<Pixel> &from, const rectify::Filters &filters)
      : filters_ (filters), windows_ (from)
  {
  }

  /** Differences beyond the noise are the scene's. */
  CODEDEXPOSURE_INLINE void choose (const rectify::Place *places, int count)
  {
    const rectify::Roughness &map = filters_.roughness;
    for (int x = 0; x < count; x++)
      chosen_[x] = places[x].filter * rectify::kNoises;
    if (!map.first)
      return;
    constexpr int kDifferences = 2 * rectify::kSteps * rectify::kSteps;
    const float to_noise = 0.5f / filters_.noise;
    for (int x = 0; x < count; x++) {
      scene_[x] = 0.0f;
      if (places[x].filter < 0)
        continue;
      const rectify::WindowScale &scale = filters_.scales[places[x].filter];
      const float rough =
          map.first[(places[x].y - map.y) * map.length + places[x].x - map.x];
      scene_[x] = (rough / kDifferences * to_noise * scale.darkness - 1.0f) *
                  scale.smoothness;
    }
    for (const float limit : filters_.limits)
      for (int x = 0; x < count; x++)
        chosen_[x] += scene_[x] <= limit;
  }

  CODEDEXPOSURE_INLINE void filter (
      const rectify::Place *places, int count, Pixel *to)
  {
    for (int x = 0; x < count; x++)
      parts_[x] =
          places[x].filter < 0
              ? Four{}
              : windows_.of (places[x]).filtered (
                    filters_.weights + std::ptrdiff_t (chosen_[x]) * kTaps *
                                           rectify::row_length (kTaps));
    const float largest = filters_.largest;
    for (int x = 0; x < count; x++) {
      const float rounded = sum_of (x) + 0.5f;
      to[x] = Pixel (std::int32_t (rounded < 0.0f      ? 0.0f
                                   : rounded > largest ? largest
                                                       : rounded));
    }
    for (int x = 0; x < count; x++)
      if (places[x].filter == rectify::Place::kLookup)
        to[x] = *windows_.corner (places[x]).first;
  }

  CODEDEXPOSURE_INLINE void find_errors (
      const rectify::Place *places, int count, float *to) const
  {
    for (int x = 0; x < count; x++) {
      to[x] = 0.0f;
      if (places[x].filter < 0)
        continue;
      const rectify::FilterError &error = filters_.errors[chosen_[x]];
      const float scene = scene_[x] > 0.0f ? scene_[x] : 0.0f;
      to[x] = __builtin_sqrtf (
          filters_.noise * (scene * error.scene + error.noise));
    }
  }

private:
  CODEDEXPOSURE_INLINE float sum_of (int x) const
  {
    const Four &v = parts_[x];
    return (v[0] + v[1]) + (v[2] + v[3]);
  }

  const rectify::Filters &filters_;
  Windows<kTaps, Pixel> windows_;
  Four parts_[kMost];
  float scene_[kMost] = {};
  std::int32_t chosen_[kMost];
};

/** RectifyRow. */
template <int kTaps, typename Pixel>
void
rectify_row (const rectify::Source<Pixel> &from, const rectify::Place *places,
    int count, const rectify::Filters &filters, Pixel *to, float *errors)
{
  using Some = Mirrors<kTaps, Pixel>;
  Some mirrors (from, filters);
  for (int x = 0; x < count; x += Some::kMost) {
    const int some = count - x < Some::kMost ? count - x : Some::kMost;
    mirrors.choose (places + x, some);
    mirrors.filter (places + x, some, to + x);
    if (errors)
      mirrors.find_errors (places + x, some, errors + x);
  }
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

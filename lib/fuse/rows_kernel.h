/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Operations on rows of pixels. Loops are simple, so that the compiler turns
 * them into vectors. */
#pragma once

#include "fuse/filter_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

template <typename Join>
CODEDEXPOSURE_INLINE void
join_rows (
    const float *const *rows, int rows_count, int count, float *to, Join join)
{
  int x = 0;
  for (; x + 2 * kFloats <= count; x += 2 * kFloats) {
    Floats a = load (rows[0] + x), b = load (rows[0] + x + kFloats);
    for (int i = 1; i < rows_count; i++) {
      a = join (a, load (rows[i] + x));
      b = join (b, load (rows[i] + x + kFloats));
    }
    store (to + x, a);
    store (to + x + kFloats, b);
  }
  for (; x < count; x += kFloats) {
    Floats a = load (rows[0] + x);
    for (int i = 1; i < rows_count; i++)
      a = join (a, load (rows[i] + x));
    store (to + x, a);
  }
}

inline void
sum (const float *const *rows, int rows_count, int count, float *to)
{
  join_rows (rows, rows_count, count, to,
      [] (Floats a, Floats b) CODEDEXPOSURE_INLINE_BODY { return a + b; });
}

inline void
max (const float *const *rows, int rows_count, int count, float *to)
{
  join_rows (rows, rows_count, count, to,
      [] (Floats a, Floats b)
          CODEDEXPOSURE_INLINE_BODY { return larger (a, b); });
}

CODEDEXPOSURE_INLINE float
clamped (float value, float low, float high)
{
  const float above = value < low ? low : value;
  return above > high ? high : above;
}

CODEDEXPOSURE_INLINE float
faded (float value, const fuse::Fade &fade)
{
  return clamped ((fade.all - value) / (fade.all - fade.none), 0.0f, 1.0f);
}

inline void
compare (const fuse::CompareRow &row, float *__restrict to)
{
  const float *now = row.now, *other = row.other;
  const float *slope = row.slope, *offset = row.offset, *frames = row.frames;
  const float floor = row.floor;
  const int count = row.count;
  for (int x = 0; x < count; x++) {
    const float mean = 0.5f * (now[x] + other[x]);
    const float light = mean < 0.0f ? 0.0f : mean;
    const float apart = now[x] - other[x];
    to[x] = apart * apart / (2.0f * (slope[x] * light + offset[x]) + floor);
  }
  if (frames)
    for (int x = 0; x < count; x++)
      to[x] *= 2.0f * frames[x] / (frames[x] + 1.0f);
}

inline void
rate (const fuse::RateRow &row, float *__restrict to)
{
  const float *sum = row.sum, *max = row.max, *unrepeated = row.unrepeated;
  const fuse::Fade mean_fade = row.mean_fade, max_fade = row.max_fade;
  const float area = row.area;
  const int count = row.count;
  for (int x = 0; x < count; x++)
    to[x] = faded (sum[x] / area, mean_fade) * faded (max[x], max_fade) *
            unrepeated[x];
}

inline void
fade_ratio (const float *a, const float *b, float floor, const fuse::Fade &fade,
    int count, float *__restrict to)
{
  const fuse::Fade by = fade;
  for (int x = 0; x < count; x++)
    to[x] = faded (a[x] / (floor + b[x]), by);
}

inline void
prefer (const fuse::PreferRow &row, float *const *to)
{
  for (int x = 0; x < row.count; x += kFloats) {
    Floats best = load (row.errors[0] + x) + row.floor;
    for (int i = 1; i < row.models; i++)
      best = smaller (best, load (row.errors[i] + x) + row.floor);
    Floats sum = {};
    for (int i = 0; i < row.models; i++) {
      const Floats ratio = best / (load (row.errors[i] + x) + row.floor);
      const Floats fourth = ratio * ratio * ratio * ratio;
      const Floats weight = fourth * fourth;
      const Floats kept = weight < row.min_weight ? Floats{} : weight;
      sum += kept;
      store (to[i] + x, kept);
    }
    for (int i = 0; i < row.models; i++)
      store (to[i] + x, load (to[i] + x) / sum);
  }
}

inline void
share (const fuse::ShareRow &row, float *__restrict base, float *const *shares)
{
  const float *weight = row.weight, *light = row.light;
  const int count = row.count;
  for (int x = 0; x < count; x++)
    base[x] = weight[x] * light[x];
  for (int i = 0; i < row.models; i++) {
    float *__restrict to = shares[i];
    for (int x = 0; x < count; x++)
      to[x] = 1.0f - weight[x];
    if (row.preferences) {
      const float *preference = row.preferences[i];
      for (int x = 0; x < count; x++)
        to[x] *= preference[x];
    }
  }
}

inline void
to_steps (
    const float *light, float steps, int count, std::int32_t *__restrict to)
{
  for (int x = 0; x < count; x++)
    to[x] = std::int32_t (clamped (light[x] * steps + 0.5f, 0.0f, 65535.0f)) -
            32768;
}

inline void
pair (std::int32_t *values, int count)
{
  for (int x = 0; x < count; x += kFloats) {
    const Ints here = load (values + x), next = load (values + x + 1);
    store (values + x, (here & 0xffff) | (next << 16));
  }
}

template <typename Pixel>
CODEDEXPOSURE_INLINE void
to_pixels (const float *light, float scale, float largest, int count,
    Pixel *__restrict to)
{
  for (int x = 0; x < count; x++)
    to[x] =
        Pixel (std::int32_t (clamped (light[x] * scale + 0.5f, 0.0f, largest)));
}

inline void
to_bytes (
    const float *light, float scale, float largest, int count, std::uint8_t *to)
{
  to_pixels (light, scale, largest, count, to);
}

inline void
to_words (const float *light, float scale, float largest, int count,
    std::uint16_t *to)
{
  to_pixels (light, scale, largest, count, to);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

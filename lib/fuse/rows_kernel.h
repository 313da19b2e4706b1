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

inline void
blur (const float *source, std::ptrdiff_t step, const float *weights, int taps,
    int count, float *to)
{
  for (int x = 0; x < count; x += kFloats) {
    Floats sum = {};
    for (int t = 0; t < taps; t++)
      sum += weights[t] * load (source + x + t * step);
    store (to + x, sum);
  }
}

CODEDEXPOSURE_INLINE float
clamped (float value, float low, float high)
{
  const float above = value < low ? low : value;
  return above > high ? high : above;
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

CODEDEXPOSURE_INLINE Floats
faded (Floats value, const fuse::Fade &fade)
{
  const Floats left = (fade.all - value) * (1.0f / (fade.all - fade.none));
  return smaller (larger (left, Floats{}), Floats{} + 1.0f);
}

inline void
rate (const fuse::RateRow &row, float *to)
{
  const float part = 1.0f / row.area;
  for (int x = 0; x < row.count; x += kFloats)
    store (to + x, faded (load (row.sum + x) * part, row.mean_fade) *
                       faded (load (row.max + x), row.max_fade) *
                       load_twice (row.unrepeated, x));
}

inline void
fade_ratio (const float *a, const float *b, float floor, const fuse::Fade &fade,
    int count, float *to)
{
  for (int x = 0; x < count; x += kFloats)
    store (to + x, faded (load (a + x) / (floor + load (b + x)), fade));
}

inline void
prefer (const fuse::PreferRow &row, float *const *to)
{
  for (int x = 0; x < row.count; x += kFloats) {
    Floats best = load (row.errors[0] + x) + row.floor;
    for (int i = 1; i < row.models; i++)
      best = smaller (best, load (row.errors[i] + x) + row.floor);
    for (int i = 0; i < row.models; i++) {
      const Floats ratio = best / (load (row.errors[i] + x) + row.floor);
      const Floats fourth = ratio * ratio * ratio * ratio;
      const Floats weight = fourth * fourth;
      store (to[i] + x,
          weight < row.min_weight ? Floats{} + row.min_weight : weight);
    }
  }
}

inline void
sum_blocks (const float *upper, const float *lower, int count, float *to)
{
  constexpr std::make_integer_sequence<int, kFloats> lanes;
  for (int x = 0; x < count; x += kFloats) {
    const Floats a = load (upper + 2 * x) + load (lower + 2 * x);
    const Floats b =
        load (upper + 2 * x + kFloats) + load (lower + 2 * x + kFloats);
    store (to + x, pick (a, b, EverySecond<0> (), lanes) +
                       pick (a, b, EverySecond<1> (), lanes));
  }
}

inline void
weigh (const fuse::WeighRow &row, float *least)
{
  for (int x = 0; x < row.count; x += kFloats) {
    Floats best = Floats{} + 1e30f, of_best = best, sum = {};
    for (int c = 0; c < row.classes; c++) {
      const Floats error = load (row.errors[c] + x);
      const Floats scaled = row.factors[c] * error + row.floor;
      of_best = scaled < best ? error + row.floor : of_best;
      best = smaller (scaled, best);
      store (row.errors[c] + x, scaled);
    }
    for (int c = 0; c < row.classes; c++) {
      const Floats ratio = best / load (row.errors[c] + x);
      const Floats fourth = ratio * ratio * ratio * ratio;
      const Floats power = fourth * fourth;
      const Floats weight = power < row.min_weight ? Floats{} : power;
      store (row.errors[c] + x, weight);
      sum += weight;
    }
    const Floats part = 1.0f / sum;
    for (int c = 0; c < row.classes; c++)
      store (row.errors[c] + x, load (row.errors[c] + x) * part);
    store (least + x, of_best);
  }
}

inline void
miss (const fuse::MissRow &row, float *missed, float *squared)
{
  for (int x = 0; x < row.count; x += kFloats) {
    Floats made = {};
    for (int s = 0; s < row.slots; s++)
      made += load (row.responses[s] + x) * load (row.light[s] + x);
    const Floats left = load (row.partner + x) - made;
    store (missed + x, left);
    store (squared + x, left * left);
  }
}

inline void
move (const fuse::MoveRow &row, float *const *light)
{
  for (int x = 0; x < row.count; x += kFloats) {
    const Floats mean = load (row.sum + x) / row.around;
    const Floats variance =
        load (row.squares + x) / row.around - mean * mean + row.floor;
    const Floats noise =
        load (row.slope + x) * larger (load (row.partner + x), Floats{}) +
        load (row.offset + x);
    const Floats by = larger (1.0f - row.noise * noise / variance, Floats{}) *
                      (load (row.missed + x) - mean) * load (row.step + x);
    for (int s = 0; s < row.slots; s++)
      store (
          light[s] + x, load (light[s] + x) + load (row.responses[s] + x) * by);
  }
}

template <int Reach = kFloats / 2>
CODEDEXPOSURE_INLINE int
sum_of_lanes (Ints v)
{
  if constexpr (Reach == 0) {
    return v[0];
  } else {
    constexpr std::make_integer_sequence<int, kFloats> lanes;
    return sum_of_lanes<Reach / 2> (
        v + pick (v, v, Rotate<kFloats, Reach> (), lanes));
  }
}

/* Whether enough pixels that move prefer a model, whose preference is 1 then.
 */
CODEDEXPOSURE_INLINE bool
is_wanted (
    const fuse::ShareRow &row, const float *preference, int first, int end)
{
  Ints best = {}, moving = {};
  int x = first;
  for (; x + kFloats <= end; x += kFloats) {
    const Ints moves = load (row.weight + x) < 1.0f;
    moving += moves;
    best += moves & (load_twice (preference, x) == 1.0f);
  }
  int bests = -sum_of_lanes (best), all = -sum_of_lanes (moving);
  for (; x < end; x++) {
    const bool moves = row.weight[x] < 1.0f;
    all += moves;
    bests += moves && preference[x / 2] == 1.0f;
  }
  return fuse::kWantedPart * bests >= all && all > 0;
}

/* Of the pixels of a vector; those of no block are not used. */
CODEDEXPOSURE_INLINE void
share_vector (const fuse::ShareRow &row, const std::uint8_t *kept, int blocks,
    int x, float *const *shares)
{
  Floats sum = {};
  for (int i = 0; i < row.models; i++)
    if (kept[i * blocks])
      sum += load_twice (row.preferences[i], x);
  const Floats rest = (1.0f - load (row.weight + x)) / sum;
  for (int i = 0; i < row.models; i++)
    store (shares[i] + x, kept[i * blocks]
                              ? load_twice (row.preferences[i], x) * rest
                              : Floats{});
}

CODEDEXPOSURE_INLINE void
share_block (const fuse::ShareRow &row, std::uint8_t *kept, int blocks,
    int first, int end, float *const *shares)
{
  for (int i = 0; i < row.models; i++)
    kept[i * blocks] = is_wanted (row, row.preferences[i], first, end);
  for (int x = first; x < end; x += kFloats)
    share_vector (row, kept, blocks, x, shares);
}

CODEDEXPOSURE_INLINE std::uint8_t
share_rest (const fuse::ShareRow &row, int first, int end, float *share)
{
  int moving = 0;
  for (int x = first; x < end; x++) {
    share[x] = 1.0f - row.weight[x];
    moving |= int (row.weight[x] < 1.0f);
  }
  return moving != 0;
}

inline void
share (const fuse::ShareRow &row, float *__restrict base, float *const *shares,
    std::uint8_t *kept)
{
  const float *weight = row.weight, *light = row.light;
  const int count = row.count;
  for (int x = 0; x < count; x++)
    base[x] = weight[x] * light[x];
  const int blocks = (count + row.block - 1) / row.block;
  for (int b = 0; b < blocks; b++) {
    const int first = b * row.block;
    const int end = count - first < row.block ? count : first + row.block;
    if (row.preferences)
      share_block (row, kept + b, blocks, first, end, shares);
    else
      kept[b] = share_rest (row, first, end, shares[0]);
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
void
to_pixels (const float *light, float scale, float largest, int count,
    Pixel *__restrict to)
{
  for (int x = 0; x < count; x++)
    to[x] =
        Pixel (std::int32_t (clamped (light[x] * scale + 0.5f, 0.0f, largest)));
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

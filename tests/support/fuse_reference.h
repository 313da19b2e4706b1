/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of fusion value by value: slow and readable. All others must give
 * the same bits. */
#pragma once

#include <algorithm>
#include <cmath>

#include "fuse/dct.h"
#include "fuse/kernels.h"

namespace codedexposure::test
{

using namespace fuse;

inline void
dct (float *values, int step)
{
  constexpr int kHalf = kBlock / 2;
  const auto &f = kDct.at;
  float sum[kHalf], difference[kHalf];
  for (int i = 0; i < kHalf; i++) {
    const float a = values[i * step], b = values[(kBlock - 1 - i) * step];
    sum[i] = a + b;
    difference[i] = a - b;
  }
  float p[3], q[3];
  for (int i = 0; i < 3; i++) {
    p[i] = sum[i] + sum[kHalf - 1 - i];
    q[i] = sum[i] - sum[kHalf - 1 - i];
  }
  const float u = difference[0] - difference[3] - difference[4];
  const float v = difference[1] - difference[2] - difference[5];
  const float middle = f[2][1] * q[1];
  const float few[kBlock] = {f[0][0] * (p[0] + p[2] + p[1]), 0.0f,
      f[2][0] * q[0] + f[2][2] * q[2] + middle, f[3][0] * u + f[3][1] * v,
      f[4][0] * (p[0] - p[2]), 0.0f, f[6][0] * (q[0] - q[1] - q[2]), 0.0f,
      f[8][0] * (p[0] + p[2]) + f[8][1] * p[1], f[9][0] * u + f[9][1] * v,
      f[2][2] * q[0] + f[2][0] * q[2] - middle, 0.0f};
  for (int k = 0; k < kBlock; k++) {
    float value = few[k];
    if (k == 1 || k == 5 || k == 7 || k == 11)
      for (int i = 0; i < kHalf; i++)
        value =
            i == 0 ? f[k][i] * difference[i] : value + f[k][i] * difference[i];
    values[k * step] = value;
  }
}

inline void
undo_dct (float *values, int step)
{
  constexpr int kHalf = kBlock / 2;
  const auto &f = kDct.at;
  const auto in = [&] (int k) { return values[k * step]; };
  const float ends = f[0][0] * in (0) + f[8][0] * in (8);
  const float fourth = f[4][0] * in (4), sixth = f[6][0] * in (6);
  const float p[] = {
      ends + fourth, f[0][0] * in (0) + f[8][1] * in (8), ends - fourth};
  const float q[] = {f[2][0] * in (2) + f[2][2] * in (10) + sixth,
      f[2][1] * (in (2) - in (10)) - sixth,
      f[2][2] * in (2) + f[2][0] * in (10) - sixth};
  const float u = f[3][0] * in (3) + f[9][0] * in (9);
  const float v = f[3][1] * in (3) + f[9][1] * in (9);
  const float few[] = {u, v, -v, -u, -u, -v};
  float out[kBlock];
  for (int i = 0; i < kHalf; i++) {
    const float even = i < 3 ? p[i] + q[i] : p[5 - i] - q[5 - i];
    const float odd = f[1][i] * in (1) + f[5][i] * in (5) + f[7][i] * in (7) +
                      f[11][i] * in (11) + few[i];
    out[i] = even + odd;
    out[kBlock - 1 - i] = even - odd;
  }
  for (int i = 0; i < kBlock; i++)
    values[i * step] = out[i];
}

/* The block of one lane: value of slot s at (x, y). */
class Block
{
public:
  Block (const ShrinkRow &row, int lane) : row_ (row), lane_ (lane) {}

  float &at (int s, int y, int x)
  {
    return row_.scratch[(s * kBlock + y) * kBlock + x];
  }
  std::ptrdiff_t place (int y, int x) const
  {
    const int column = x + row_.shift;
    return y * row_.stride + (column % kBlockStep) * row_.split +
           column / kBlockStep + lane_;
  }
  float factor (int k, int s) const
  {
    return row_.slot_transform[k * row_.slots + s];
  }
  void transform_slots (int y, int x)
  {
    const int slots = row_.slots, half = slots / 2;
    float in[16] = {};
    for (int s = 0; s < slots; s++)
      in[s] = at (s, y, x);
    for (int k = 0; k < slots; k++) {
      float sum = slots % 2 ? factor (k, half) * in[half] : 0.0f;
      for (int s = 0; s < half; s++)
        sum += factor (k, s) *
               (k % 2 ? in[s] - in[slots - 1 - s] : in[s] + in[slots - 1 - s]);
      at (k, y, x) = sum;
    }
  }
  void undo_transform_slots (int y, int x)
  {
    const int slots = row_.slots;
    float in[16] = {};
    for (int k = 0; k < slots; k++)
      in[k] = at (k, y, x);
    for (int s = 0; s < (slots + 1) / 2; s++) {
      float part[2] = {};
      for (int k = 0; k < slots; k++)
        part[k % 2] += factor (k, s) * in[k];
      at (slots - 1 - s, y, x) = part[0] - part[1];
      at (s, y, x) = part[0] + part[1];
    }
  }
  /* Slots first. */
  void read ()
  {
    for (int y = 0; y < kBlock; y++) {
      for (int x = 0; x < kBlock; x++) {
        for (int s = 0; s < row_.slots; s++)
          at (s, y, x) = row_.source[s][place (y, x)];
        transform_slots (y, x);
      }
    }
    for (int k = 0; k < row_.slots; k++) {
      for (int y = 0; y < kBlock; y++)
        dct (&at (k, y, 0), 1);
      for (int x = 0; x < kBlock; x++)
        dct (&at (k, 0, x), kBlock);
    }
  }
  /* Returns the number of coefficients that are kept. */
  int shrink ()
  {
    int kept = 0;
    for (int k = 0; k < row_.slots; k++) {
      for (int i = 0; i < kBlock * kBlock; i++) {
        float &value = (&at (k, 0, 0))[i];
        const bool mean = k == 0 && i == 0;
        if (mean || std::abs (value) > row_.threshold)
          kept++;
        else
          value = 0.0f;
      }
    }
    return kept;
  }
  void add (float weight)
  {
    for (int k = 0; k < row_.slots; k++) {
      for (int x = 0; x < kBlock; x++)
        undo_dct (&at (k, 0, x), kBlock);
      for (int y = 0; y < kBlock; y++)
        undo_dct (&at (k, y, 0), 1);
    }
    for (int y = 0; y < kBlock; y++) {
      for (int x = 0; x < kBlock; x++) {
        undo_transform_slots (y, x);
        for (int s = 0; s < row_.slots; s++)
          row_.sum[s][place (y, x)] += weight * at (s, y, x);
        row_.weight[place (y, x)] += weight;
      }
    }
  }

private:
  const ShrinkRow &row_;
  int lane_;
};

inline float
filtered (const FilterRow &row, int k, int i)
{
  std::int64_t sum = 0;
  for (int t = 0; t < row.pairs_count; t++) {
    const std::int32_t *pair = row.pairs + t * (1 + row.outputs);
    for (const int shift : {0, 16})
      sum += std::int64_t (std::int16_t (pair[1 + k] >> shift)) *
             std::int16_t (row.sources[pair[0]][i] >> shift);
  }
  return row.scale[k] * float (std::int32_t (sum)) + row.base;
}

/* Calls use (k, i) for all outputs and values of the runs. */
template <typename Use>
void
each_value (const FilterRow &row, const Use &use)
{
  for (int k = 0; k < row.outputs; k++)
    for (int r = 0; r < row.runs_count; r++)
      for (int i = 0; i < row.runs[r].count; i++)
        use (k, row.runs[r].first + i);
}

inline void
reference_filter_squared (const FilterRow &row, float *const *to)
{
  each_value (row, [&] (int k, int i) {
    const float value = filtered (row, k, i);
    to[k][i] += value * value;
  });
}

inline void
reference_filter_add (
    const FilterRow &row, const float *share, float *const *to)
{
  each_value (
      row, [&] (int k, int i) { to[k][i] += share[i] * filtered (row, k, i); });
}

template <typename T>
void
reference_split (const Parts &parts, const T *from, T *to)
{
  for (int x = 0; x < parts.count; x++)
    to[x % parts.period * parts.stride + x / parts.period] = from[x];
}

inline void
reference_join (
    const Parts &parts, const float *from, const float *add, float *to)
{
  for (int x = 0; x < parts.count; x++)
    to[x] = (add ? add[x] : 0.0f) +
            from[x % parts.period * parts.stride + x / parts.period];
}

inline void
reference_sum (const float *const *rows, int rows_count, int count, float *to)
{
  for (int x = 0; x < count; x++) {
    float sum = rows[0][x];
    for (int i = 1; i < rows_count; i++)
      sum += rows[i][x];
    to[x] = sum;
  }
}

inline void
reference_max (const float *const *rows, int rows_count, int count, float *to)
{
  for (int x = 0; x < count; x++) {
    float largest = rows[0][x];
    for (int i = 1; i < rows_count; i++)
      largest = std::max (largest, rows[i][x]);
    to[x] = largest;
  }
}

inline void
reference_blur (const float *source, std::ptrdiff_t step, const float *weights,
    int taps, int count, float *to)
{
  for (int x = 0; x < count; x++) {
    float sum = 0.0f;
    for (int t = 0; t < taps; t++)
      sum += weights[t] * source[x + t * step];
    to[x] = sum;
  }
}

inline float
faded (float value, const Fade &fade)
{
  return std::clamp (
      (fade.all - value) * (1.0f / (fade.all - fade.none)), 0.0f, 1.0f);
}

inline void
reference_compare (const CompareRow &row, float *to)
{
  for (int x = 0; x < row.count; x++) {
    const float apart = row.now[x] - row.other[x];
    const float light = std::max (0.5f * (row.now[x] + row.other[x]), 0.0f);
    const float variance = row.slope[x] * light + row.offset[x];
    to[x] = apart * apart / (2.0f * variance + row.floor);
    if (row.frames)
      to[x] *= 2.0f * row.frames[x] / (row.frames[x] + 1.0f);
  }
}

inline void
reference_rate (const RateRow &row, float *to)
{
  for (int x = 0; x < row.count; x++)
    to[x] = faded (row.sum[x] * (1.0f / row.area), row.mean_fade) *
            faded (row.max[x], row.max_fade) * row.unrepeated[x / 2];
}

inline void
reference_fade_ratio (const float *a, const float *b, float floor,
    const Fade &fade, int count, float *to)
{
  for (int x = 0; x < count; x++)
    to[x] = faded (a[x] / (floor + b[x]), fade);
}

inline void
reference_prefer (const PreferRow &row, float *const *to)
{
  for (int x = 0; x < row.count; x++) {
    float best = 1e30f;
    for (int i = 0; i < row.models; i++)
      best = std::min (best, row.errors[i][x] + row.floor);
    for (int i = 0; i < row.models; i++) {
      const float ratio = best / (row.errors[i][x] + row.floor);
      const float fourth = ratio * ratio * ratio * ratio;
      to[i][x] = std::max (fourth * fourth, row.min_weight);
    }
  }
}

inline void
reference_share (
    const ShareRow &row, float *base, float *const *shares, std::uint8_t *kept)
{
  const auto preference = [&] (int i, int x) {
    return row.preferences ? row.preferences[i][x / 2] : 1.0f;
  };
  const int blocks = (row.count + row.block - 1) / row.block;
  for (int b = 0; b < blocks; b++) {
    const int end = std::min ((b + 1) * row.block, row.count);
    for (int i = 0; i < row.models; i++) {
      int best = 0, moving = 0;
      for (int x = b * row.block; x < end; x++) {
        moving += row.weight[x] < 1.0f;
        best += row.weight[x] < 1.0f && preference (i, x) == 1.0f;
      }
      kept[i * blocks + b] = moving > 0 && best * kWantedPart >= moving;
    }
  }
  for (int x = 0; x < row.count; x++)
    base[x] = row.weight[x] * row.light[x];
  for (int x = 0; x < row.count; x++) {
    float sum = 0.0f;
    for (int i = 0; i < row.models; i++)
      if (kept[i * blocks + x / row.block])
        sum += preference (i, x);
    const float rest = (1.0f - row.weight[x]) / sum;
    for (int i = 0; i < row.models; i++)
      shares[i][x] =
          kept[i * blocks + x / row.block] ? preference (i, x) * rest : 0.0f;
  }
}

inline void
reference_sum_blocks (
    const float *upper, const float *lower, int count, float *to)
{
  for (int x = 0; x < count; x++)
    to[x] =
        (upper[2 * x] + lower[2 * x]) + (upper[2 * x + 1] + lower[2 * x + 1]);
}

inline void
reference_weigh (const WeighRow &row, float *least)
{
  for (int x = 0; x < row.count; x++) {
    float best = 1e30f, sum = 0.0f;
    for (int c = 0; c < row.classes; c++) {
      const float scaled = row.factors[c] * row.errors[c][x] + row.floor;
      if (scaled < best) {
        best = scaled;
        least[x] = row.errors[c][x] + row.floor;
      }
    }
    for (int c = 0; c < row.classes; c++) {
      float &weight = row.errors[c][x];
      const float ratio = best / (row.factors[c] * weight + row.floor);
      const float fourth = ratio * ratio * ratio * ratio;
      weight = fourth * fourth < row.min_weight ? 0.0f : fourth * fourth;
      sum += weight;
    }
    const float part = 1.0f / sum;
    for (int c = 0; c < row.classes; c++)
      row.errors[c][x] *= part;
  }
}

inline void
reference_to_steps (
    const float *light, float steps, int count, std::int32_t *to)
{
  for (int x = 0; x < count; x++)
    to[x] =
        std::int32_t (std::clamp (light[x] * steps + 0.5f, 0.0f, 65535.0f)) -
        32768;
}

inline void
reference_pair (std::int32_t *values, int count)
{
  for (int x = 0; x < count; x++)
    values[x] = std::int32_t (std::uint32_t (values[x]) % 65536 +
                              std::uint32_t (values[x + 1]) * 65536);
}

template <typename Pixel>
void
reference_to_pixels (
    const float *light, float scale, float largest, int count, Pixel *to)
{
  for (int x = 0; x < count; x++)
    to[x] = Pixel (std::clamp (light[x] * scale + 0.5f, 0.0f, largest));
}

inline void
reference_shrink (const ShrinkRow &row)
{
  for (int lane = row.blocks - 1; lane >= 0; lane--) {
    Block block (row, lane);
    block.read ();
    block.add (1.0f / float (block.shrink ()));
  }
}

/* With sums of 64 bits, which show whether those of 32 bits are enough. */
inline std::int64_t
reference_convolution (const ConvolveRow &row, int x, int k)
{
  std::int64_t sum = row.bias[k];
  for (int t = 0; t < 9; t++)
    for (int i = 0; i < row.inputs; i++) {
      const int pair = (t * row.inputs + i) / 2 * row.outputs + k;
      sum += row.weights[pair * 2 + i % 2] *
             row.source[t / 3][(x + t % 3) * row.inputs + i];
    }
  return sum;
}

inline void
reference_convolve (const ConvolveRow &row)
{
  for (int x = 0; x < row.pixels; x++)
    for (int k = 0; k < row.outputs; k++) {
      const int at = x * row.outputs + k;
      const float value =
          row.scale[k] * float (reference_convolution (row, x, k));
      if (!row.hidden) {
        row.to[at] = value;
        continue;
      }
      const int steps = int (std::clamp (value + 0.5f, 0.0f, 32767.0f));
      row.hidden[at] =
          std::int16_t (std::min (steps + (row.add ? row.add[at] : 0), 32767));
    }
}

inline void
reference_settle (const SettleRow &row)
{
  for (int x = 0; x < row.count; x++) {
    const float inverse = 1.0f / row.weight[x];
    for (int s = 0; s < row.slots; s++) {
      float &light = row.light[s][x];
      if (row.weight[x] > 0.0f)
        light += row.step * (row.sum[s][x] * inverse - light);
      if (row.measured[x] == s)
        light = row.coded[x];
      row.sum[s][x] = 0.0f;
    }
    row.weight[x] = 0.0f;
  }
}

inline void
reference_miss (const MissRow &row, float *missed, float *squared)
{
  for (int x = 0; x < row.count; x++) {
    float made = 0.0f;
    for (int s = 0; s < row.slots; s++)
      made += row.responses[s][x] * row.light[s][x];
    missed[x] = row.partner[x] - made;
    squared[x] = missed[x] * missed[x];
  }
}

inline void
reference_move (const MoveRow &row, float *const *light)
{
  for (int x = 0; x < row.count; x++) {
    const float mean = row.sum[x] / row.around;
    const float variance =
        row.squares[x] / row.around - mean * mean + row.floor;
    const float noise =
        row.slope[x] * std::max (row.partner[x], 0.0f) + row.offset[x];
    const float by = std::max (1.0f - row.noise * noise / variance, 0.0f) *
                     (row.missed[x] - mean) * row.step[x];
    for (int s = 0; s < row.slots; s++)
      light[s][x] += row.responses[s][x] * by;
  }
}

inline constexpr Kernels kReference{"reference", reference_filter_squared,
    reference_filter_add, reference_split<std::int32_t>, reference_split<float>,
    reference_join, reference_sum, reference_max, reference_blur,
    reference_compare, reference_rate, reference_fade_ratio, reference_prefer,
    reference_share, reference_sum_blocks, reference_weigh, reference_to_steps,
    reference_pair, reference_to_pixels<std::uint8_t>,
    reference_to_pixels<std::uint16_t>, reference_shrink, reference_settle,
    reference_miss, reference_move, reference_convolve};

} // namespace codedexposure::test

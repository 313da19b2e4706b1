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

inline float
filtered (const FilterRow &row, int x, int k)
{
  float sum = 0.0f;
  for (int t = 0; t < row.taps; t++)
    sum += row.weights[(t * row.outputs + k) * row.width +
                       (row.phase + x) % row.period] *
           row.source[x + row.offsets[t]];
  return sum;
}

inline void
dct (float *values, int step)
{
  constexpr int kHalf = kBlock / 2;
  float sum[kHalf], difference[kHalf];
  for (int i = 0; i < kHalf; i++) {
    const float a = values[i * step], b = values[(kBlock - 1 - i) * step];
    sum[i] = a + b;
    difference[i] = a - b;
  }
  for (int k = 0; k < kBlock; k++) {
    float value = 0.0f;
    for (int i = 0; i < kHalf; i++)
      value += kDct.at[k][i] * (k % 2 ? difference[i] : sum[i]);
    values[k * step] = value;
  }
}

inline void
undo_dct (float *values, int step)
{
  constexpr int kHalf = kBlock / 2;
  float out[kBlock];
  for (int i = 0; i < kHalf; i++) {
    float part[2] = {};
    for (int k = 0; k < kBlock; k++)
      part[k % 2] += kDct.at[k][i] * values[k * step];
    out[i] = part[0] + part[1];
    out[kBlock - 1 - i] = part[0] - part[1];
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
  void transform_slots (int y, int x, bool back)
  {
    float in[16] = {};
    for (int s = 0; s < row_.slots; s++)
      in[s] = at (s, y, x);
    for (int k = 0; k < row_.slots; k++) {
      float sum = 0.0f;
      for (int s = 0; s < row_.slots; s++)
        sum += row_.slot_transform[back ? s * row_.slots + k
                                        : k * row_.slots + s] *
               in[s];
      at (k, y, x) = sum;
    }
  }
  /* Slots first. */
  void read ()
  {
    for (int y = 0; y < kBlock; y++) {
      for (int x = 0; x < kBlock; x++) {
        for (int s = 0; s < row_.slots; s++)
          at (s, y, x) = row_.source[s][place (y, x)];
        transform_slots (y, x, false);
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
        transform_slots (y, x, true);
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

inline void
reference_filter (const FilterRow &row, float *const *outputs)
{
  for (int k = 0; k < row.outputs; k++)
    for (int x = 0; x < row.count; x++)
      outputs[k][x] = filtered (row, x, k);
}

inline float
filtered_pairs (const PairRow &row, int x, int k)
{
  const int i = (row.phase + x) % row.period;
  std::int64_t sum = 0;
  for (int t = 0; t < row.taps; t++) {
    const std::int32_t weights =
        row.weights[(t * row.outputs + k) * row.width + i];
    const std::int32_t values = row.sources[t][x];
    for (const int shift : {0, 16})
      sum += std::int64_t (std::int16_t (weights >> shift)) *
             std::int16_t (values >> shift);
  }
  return row.scale[k * row.width + i] * float (std::int32_t (sum)) + row.base;
}

inline void
reference_filter_pairs_squared (const PairRow &row, float *const *outputs)
{
  for (int k = 0; k < row.outputs; k++)
    for (int x = 0; x < row.count; x++) {
      const float value = filtered_pairs (row, x, k);
      outputs[k][x] = value * value;
    }
}

inline void
reference_filter_pairs_add (
    const PairRow &row, const float *share, float *const *outputs)
{
  for (int k = 0; k < row.outputs; k++)
    for (int x = 0; x < row.count; x++)
      outputs[k][x] += share[x] * filtered_pairs (row, x, k);
}

inline float
filtered_sparse (const SparseRow &row, int i)
{
  std::int64_t sum = 0;
  for (int t = 0; t < row.pairs_count; t++) {
    const auto [source, weights] = row.pairs[t];
    for (const int shift : {0, 16})
      sum += std::int64_t (std::int16_t (weights >> shift)) *
             std::int16_t (row.sources[source][i] >> shift);
  }
  return row.scale * float (std::int32_t (sum)) + row.base;
}

/* Calls use (i) for all values of the runs. */
template <typename Use>
void
each_value (const SparseRow &row, const Use &use)
{
  for (int r = 0; r < row.runs_count; r++)
    for (int i = 0; i < row.runs[r].count; i++)
      use (row.runs[r].first + i);
}

inline void
reference_filter_sparse_squared (const SparseRow &row, float *to)
{
  each_value (row, [&] (int i) {
    const float value = filtered_sparse (row, i);
    to[i] += value * value;
  });
}

inline void
reference_filter_sparse_add (
    const SparseRow &row, const float *share, float *to)
{
  each_value (
      row, [&] (int i) { to[i] += share[i] * filtered_sparse (row, i); });
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

inline void
reference_convolve (const ConvolveRow &row)
{
  for (int x = 0; x < row.pixels; x++) {
    for (int k = 0; k < row.outputs; k++) {
      float sum = row.bias[k];
      for (int t = 0; t < 9; t++)
        for (int i = 0; i < row.inputs; i++)
          sum = std::fma (row.weights[(t * row.inputs + i) * row.outputs + k],
              row.source[t / 3][(x + t % 3) * row.inputs + i], sum);
      if (row.hidden)
        sum = std::max (sum, 0.0f);
      if (row.add)
        sum += row.add[x * row.outputs + k];
      row.to[x * row.outputs + k] = sum;
    }
  }
}

inline constexpr Kernels kReference{"reference", reference_filter,
    reference_filter_pairs_squared, reference_filter_pairs_add,
    reference_filter_sparse_squared, reference_filter_sparse_add,
    reference_split<std::int32_t>, reference_split<float>, reference_join,
    reference_sum, reference_max, reference_compare, reference_rate,
    reference_fade_ratio, reference_prefer, reference_share, reference_to_steps,
    reference_pair, reference_to_pixels<std::uint8_t>,
    reference_to_pixels<std::uint16_t>, reference_shrink, reference_convolve};

} // namespace codedexposure::test

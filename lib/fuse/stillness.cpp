/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/stillness.h"

#include <algorithm>

namespace cexp::fuse
{

namespace
{

/* Changes below this, in grey levels squared, are none: rounding, a lamp. */
constexpr float kFloor = 0.5f;
/* Mean square of the changes around a pixel, in units of what noise does, up
 * to which it stands still, and from which on it does not. */
constexpr float kStillMean = 1.8f, kMovedMean = 3.0f;
/* The same for the largest of them: something small may have passed. */
constexpr float kStillMost = 25.0f, kMovedMost = 40.0f;
/* Errors of prediction if still in units of those if moved, up to which nothing
 * repeats itself, and from which on it does. */
constexpr float kStillError = 1.3f, kMovedError = 1.8f;
/* Frames over which still light is averaged. */
constexpr float kMemory = 16.0f;

float
fade (float value, float none, float all)
{
  return std::clamp ((all - value) / (all - none), 0.0f, 1.0f);
}

} // namespace

Stillness::Stillness (int width, int height, Extent cell, bool average)
    : radius_ (std::max (3, std::max (cell.width, cell.height) / 2 + 1)),
      average_ (average), mean_ (width, height), count_ (width, height),
      change_ (width, height, radius_), rows_sum_ (width, height, radius_),
      rows_most_ (width, height, radius_), credible_ (width, height),
      weight_ (width, height)
{
}

/* change_ = squared difference in units of its variance. */
void
Stillness::compare (const Field &now, const Field &other, const Field *count,
    const NoiseMap &noise)
{
  const int width = now.width ();
  for (int y = 0; y < now.height (); y++) {
    const float *a = now.row (y), *b = other.row (y);
    const float *slope = noise.slope.row (y), *offset = noise.offset.row (y);
    float *change = change_.row (y);
    for (int x = 0; x < width; x++) {
      const float variance =
          slope[x] * std::max (0.5f * (a[x] + b[x]), 0.0f) + offset[x];
      change[x] = (a[x] - b[x]) * (a[x] - b[x]) / (2.0f * variance + kFloor);
    }
    if (count) {
      const float *frames = count->row (y);
      for (int x = 0; x < width; x++)
        change[x] *= 2.0f * frames[x] / (frames[x] + 1.0f);
    }
    for (int x = 1; x <= radius_; x++) {
      change[-x] = change[0];
      change[width - 1 + x] = change[width - 1];
    }
  }
}

/* Sums and maxima of change_ over squares, along rows first. */
void
Stillness::judge (Field &weight, bool raise)
{
  const int width = weight.width (), height = weight.height ();
  const float area = float ((2 * radius_ + 1) * (2 * radius_ + 1));
  for (int y = 0; y < height; y++) {
    const float *change = change_.row (y);
    float *sum = rows_sum_.row (y), *most = rows_most_.row (y);
    std::fill_n (sum, width, 0.0f);
    std::fill_n (most, width, 0.0f);
    for (int i = -radius_; i <= radius_; i++) {
      for (int x = 0; x < width; x++) {
        sum[x] += change[x + i];
        most[x] = std::max (most[x], change[x + i]);
      }
    }
  }
  const auto room = std::size_t (weight.stride ());
  std::vector<float> sums (room), mosts (room);
  for (int y = 0; y < height; y++) {
    float *const sum = sums.data (), *const most = mosts.data ();
    std::fill_n (sum, width, 0.0f);
    std::fill_n (most, width, 0.0f);
    for (int i = -radius_; i <= radius_; i++) {
      const int from = std::clamp (y + i, 0, height - 1);
      const float *row_sum = rows_sum_.row (from);
      const float *row_most = rows_most_.row (from);
      for (int x = 0; x < width; x++) {
        sum[x] += row_sum[x];
        most[x] = std::max (most[x], row_most[x]);
      }
    }
    float *out = weight.row (y);
    const float *credible = credible_.row (y);
    for (int x = 0; x < width; x++) {
      const float still = fade (sum[x] / area, kStillMean, kMovedMean) *
                          fade (most[x], kStillMost, kMovedMost) * credible[x];
      out[x] = raise ? std::max (out[x], still) : still;
    }
  }
}

/* credible_ = where the errors if still are not larger than those if moved. */
void
Stillness::doubt (const Field &still, const Field &moved)
{
  const int width = still.width (), height = still.height ();
  const auto along = [&] (const Field &errors, Field &sums) {
    for (int y = 0; y < height; y++) {
      float *change = change_.row (y), *sum = sums.row (y);
      std::copy_n (errors.row (y), width, change);
      for (int x = 1; x <= radius_; x++) {
        change[-x] = change[0];
        change[width - 1 + x] = change[width - 1];
      }
      std::fill_n (sum, width, 0.0f);
      for (int i = -radius_; i <= radius_; i++)
        for (int x = 0; x < width; x++)
          sum[x] += change[x + i];
    }
  };
  along (still, rows_sum_);
  along (moved, rows_most_);
  Field sums (width, 2);
  float *const if_still = sums.row (0), *const if_moved = sums.row (1);
  const float floor = kFloor * float ((2 * radius_ + 1) * (2 * radius_ + 1));
  for (int y = 0; y < height; y++) {
    std::fill_n (if_still, width, 0.0f);
    std::fill_n (if_moved, width, floor);
    for (int i = -radius_; i <= radius_; i++) {
      const int from = std::clamp (y + i, 0, height - 1);
      const float *a = rows_sum_.row (from), *b = rows_most_.row (from);
      for (int x = 0; x < width; x++) {
        if_still[x] += a[x];
        if_moved[x] += b[x];
      }
    }
    float *credible = credible_.row (y);
    for (int x = 0; x < width; x++)
      credible[x] = fade (if_still[x] / if_moved[x], kStillError, kMovedError);
  }
}

void
Stillness::take (const Field &coded, const Field *after, const NoiseMap &noise,
    const Field &still, const Field &moved)
{
  doubt (still, moved);
  const int width = coded.width (), height = coded.height ();
  if (begun_) {
    compare (coded, mean_, &count_, noise);
    judge (weight_, false);
  }
  for (int y = 0; y < height; y++) {
    const float *now = coded.row (y);
    float *mean = mean_.row (y), *count = count_.row (y);
    float *weight = weight_.row (y);
    for (int x = 0; x < width; x++) {
      const bool goes_on = begun_ && average_ && weight[x] > 0.5f;
      count[x] = goes_on ? std::min (count[x] + 1.0f, kMemory) : 1.0f;
      mean[x] = goes_on ? mean[x] + (now[x] - mean[x]) / count[x] : now[x];
    }
    if (!begun_)
      std::fill_n (weight, width, 0.0f);
  }
  if (after) {
    compare (*after, coded, nullptr, noise);
    judge (weight_, true);
  }
  begun_ = true;
}

} // namespace cexp::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/static_pixels.h"

#include <algorithm>

namespace codedexposure::fuse
{

namespace
{

/* Changes below this, in grey levels squared, are ignored: rounding, a lamp
 * that flickers. */
constexpr float kFloor = 0.5f;
/* Mean squared change around a pixel in units of the noise's, up to which it is
 * static, and from which on it moves. */
constexpr float kStaticMean = 1.8f, kMovedMean = 3.0f;
/* The same for the largest squared change: a small object may have passed. */
constexpr float kStaticMax = 25.0f, kMovedMax = 40.0f;
/* Ratio of the prediction errors if static and if moving, up to which nothing
 * repeats, and from which on it does. */
constexpr float kUniqueError = 1.3f, kRepeatedError = 1.8f;
/* Frames over which static light is averaged. */
constexpr float kMemory = 16.0f;

float
fade (float value, float none, float all)
{
  return std::clamp ((all - value) / (all - none), 0.0f, 1.0f);
}

/* change = squared difference of rows @y in units of its variance. @count:
 * frames of which @other is the mean. */
void
compare (const Field &now, const Field &other, const Field *count,
    const NoiseMap &noise, int y, float *change)
{
  const int width = now.width ();
  const float *a = now.row (y), *b = other.row (y);
  const float *slope = noise.slope.row (y), *offset = noise.offset.row (y);
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
}

} // namespace

StaticPixels::StaticPixels (int width, int height, int radius, bool average)
    : radius_ (radius), average_ (average), mean_ (width, height),
      count_ (width, height), change_ (width, 1, radius),
      sums_ (width, height, radius), maxima_ (width, height, radius),
      unrepeated_ (width, height), weight_ (width, height)
{
}

int
StaticPixels::radius_of (Extent cell)
{
  return std::max (3, std::max (cell.width, cell.height) / 2 + 1);
}

/* Sets weight_ by the differences of @now from @other; only where that raises
 * it if @raise. */
void
StaticPixels::compare_frames (const Kernels &kernels, const Field &now,
    const Field &other, const Field *count, const NoiseMap &noise, bool raise)
{
  const int height = now.height ();
  float *change = change_.row (0);
  for (int y = 0; y < height + radius_; y++) {
    if (y < height) {
      compare (now, other, count, noise, y, change);
      sums_.extend (change);
      sums_.add_row (kernels.sum, y, change);
      maxima_.add_row (kernels.max, y, change);
    }
    if (y >= radius_)
      rate_row (y - radius_, sums_.result (kernels.sum, y - radius_),
          maxima_.result (kernels.max, y - radius_), raise);
  }
}

void
StaticPixels::rate_row (int y, const float *sum, const float *max, bool raise)
{
  const int width = weight_.width ();
  const float area = float ((2 * radius_ + 1) * (2 * radius_ + 1));
  const float *unrepeated = unrepeated_.row (y);
  float *out = weight_.row (y);
  const float before = raise ? 1.0f : 0.0f;
  for (int x = 0; x < width; x++) {
    const float rating = fade (sum[x] / area, kStaticMean, kMovedMean) *
                         fade (max[x], kStaticMax, kMovedMax) * unrepeated[x];
    out[x] = std::max (rating, before * out[x]);
  }
}

void
StaticPixels::set_errors (int y, const float *if_static, const float *if_moving)
{
  const int width = weight_.width ();
  const float floor = kFloor * float ((2 * radius_ + 1) * (2 * radius_ + 1));
  float *unrepeated = unrepeated_.row (y);
  for (int x = 0; x < width; x++)
    unrepeated[x] = fade (
        if_static[x] / (floor + if_moving[x]), kUniqueError, kRepeatedError);
}

void
StaticPixels::update (const Kernels &kernels, const Field &coded,
    const Field *after, const NoiseMap &noise)
{
  const int width = coded.width (), height = coded.height ();
  if (begun_)
    compare_frames (kernels, coded, mean_, &count_, noise, false);
  for (int y = 0; y < height; y++) {
    const float *now = coded.row (y);
    float *mean = mean_.row (y), *count = count_.row (y);
    float *weight = weight_.row (y);
    for (int x = 0; x < width; x++) {
      const bool stays = begun_ && average_ && weight[x] > 0.5f;
      count[x] = stays ? std::min (count[x] + 1.0f, kMemory) : 1.0f;
      mean[x] = stays ? mean[x] + (now[x] - mean[x]) / count[x] : now[x];
    }
    if (!begun_)
      std::fill_n (weight, width, 0.0f);
  }
  if (after)
    compare_frames (kernels, *after, coded, nullptr, noise, true);
  begun_ = true;
}

} // namespace codedexposure::fuse

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
/* Pixels with more weight are static. */
constexpr float kStatic = 0.5f;

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

StaticPixels::StaticPixels (
    int width, int height, int radius, bool average, float largest)
    : radius_ (radius), average_ (average), steps_ (65535.0f / largest),
      last_ (width, height), change_ (width, 1, radius),
      sums_ (width, height, radius), maxima_ (width, height, radius),
      unrepeated_ (width, height), weight_ (width, height),
      unchanged_ (width, height)
{
  if (!average)
    return;
  for (Field *field : {&mean_, &count_, &light_})
    *field = Field (width, height);
  sum_.resize (std::size_t (width) * std::size_t (height));
  past_.resize (sum_.size () * kMemory);
}

int
StaticPixels::radius_of (Extent cell)
{
  return std::max (3, std::max (cell.width, cell.height) / 2 + 1);
}

/* Sets @rating by the differences of @now from @other. */
void
StaticPixels::compare_frames (const Kernels &kernels, const Field &now,
    const Field &other, const Field *count, const NoiseMap &noise,
    Field &rating)
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
          maxima_.result (kernels.max, y - radius_), rating);
  }
}

void
StaticPixels::rate_row (
    int y, const float *sum, const float *max, Field &rating)
{
  const int width = rating.width ();
  const float area = float ((2 * radius_ + 1) * (2 * radius_ + 1));
  const float *unrepeated = unrepeated_.row (y);
  float *out = rating.row (y);
  for (int x = 0; x < width; x++)
    out[x] = fade (sum[x] / area, kStaticMean, kMovedMean) *
             fade (max[x], kStaticMax, kMovedMax) * unrepeated[x];
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

std::uint16_t *
StaticPixels::past_row (std::int64_t frame, int y)
{
  const auto slot = std::size_t (frame % kMemory);
  const auto width = std::size_t (light_.width ());
  return past_.data () + slot * sum_.size () + std::size_t (y) * width;
}

/* Adds row @y of the next frame to the mean of the frames since the last
 * change, and takes the oldest away. Where the frame differs from the mean by
 * changes that were too slow to be seen from frame to frame, it is the light.
 */
void
StaticPixels::average_row (int y, const float *now)
{
  const int width = light_.width ();
  const float *weight = weight_.row (y), *unchanged = unchanged_.row (y);
  float *light = light_.row (y), *mean = mean_.row (y), *count = count_.row (y);
  std::uint32_t *sum = sum_.data () + std::ptrdiff_t (y) * width;
  std::uint16_t *past = past_row (frames_, y); // the oldest
  const float largest = 65535.0f;
  for (int x = 0; x < width; x++) {
    const auto steps =
        std::uint16_t (std::clamp (now[x] * steps_ + 0.5f, 0.0f, largest));
    const bool stays = frames_ > 0 && unchanged[x] > kStatic;
    const bool full = stays && count[x] >= float (kMemory);
    sum[x] = (stays ? sum[x] : 0u) - (full ? past[x] : 0u) + steps;
    past[x] = steps;
    count[x] = (stays ? count[x] : 0.0f) + (full ? 0.0f : 1.0f);
    mean[x] = stays ? float (sum[x]) / (count[x] * steps_) : now[x];
    light[x] = weight[x] > kStatic ? mean[x] : now[x];
  }
}

void
StaticPixels::update (const Kernels &kernels, const Field &coded,
    const Field *after, const NoiseMap &noise)
{
  const int width = coded.width (), height = coded.height ();
  if (frames_ == 0)
    for (int y = 0; y < height; y++)
      std::fill_n (weight_.row (y), width, 0.0f);
  else if (average_)
    compare_frames (kernels, coded, mean_, &count_, noise, weight_);
  else
    compare_frames (kernels, coded, last_, nullptr, noise, weight_);
  if (average_ && frames_ > 0 && !compared_)
    compare_frames (kernels, coded, last_, nullptr, noise, unchanged_);
  for (int y = 0; y < height; y++) {
    if (average_)
      average_row (y, coded.row (y));
    std::copy_n (coded.row (y), width, last_.row (y));
  }
  frames_++;
  compared_ = after != nullptr;
  if (!after)
    return;
  compare_frames (kernels, *after, coded, nullptr, noise, unchanged_);
  for (int y = 0; y < height; y++) {
    const float *unchanged = unchanged_.row (y);
    float *weight = weight_.row (y);
    for (int x = 0; x < width; x++)
      weight[x] = std::max (weight[x], unchanged[x]);
  }
}

} // namespace codedexposure::fuse

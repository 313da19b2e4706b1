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

/* change = squared difference of rows @y in units of its variance. */
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

Stillness::Stillness (int width, int height, int radius, bool average)
    : radius_ (radius), average_ (average), mean_ (width, height),
      count_ (width, height), change_ (width, 1, radius),
      sums_ (width, height, radius), mosts_ (width, height, radius),
      credible_ (width, height), weight_ (width, height)
{
}

int
Stillness::radius_of (Extent cell)
{
  return std::max (3, std::max (cell.width, cell.height) / 2 + 1);
}

/* weight_ by how @now differs from @other. */
void
Stillness::judge (const Kernels &kernels, const Field &now, const Field &other,
    const Field *count, const NoiseMap &noise, bool raise)
{
  const int height = now.height ();
  float *change = change_.row (0);
  for (int y = 0; y < height + radius_; y++) {
    if (y < height) {
      compare (now, other, count, noise, y, change);
      sums_.extend (change);
      sums_.take (kernels.sum, y, change);
      mosts_.take (kernels.most, y, change);
    }
    if (y >= radius_)
      weigh (y - radius_, sums_.square (kernels.sum, y - radius_),
          mosts_.square (kernels.most, y - radius_), raise);
  }
}

void
Stillness::weigh (int y, const float *sum, const float *most, bool raise)
{
  const int width = weight_.width ();
  const float area = float ((2 * radius_ + 1) * (2 * radius_ + 1));
  const float *credible = credible_.row (y);
  float *out = weight_.row (y);
  const float before = raise ? 1.0f : 0.0f;
  for (int x = 0; x < width; x++) {
    const float still = fade (sum[x] / area, kStillMean, kMovedMean) *
                        fade (most[x], kStillMost, kMovedMost) * credible[x];
    out[x] = std::max (still, before * out[x]);
  }
}

/* credible_ = where the errors if still are not larger than those if moved. */
void
Stillness::doubt (int y, const float *still, const float *moved)
{
  const int width = weight_.width ();
  const float floor = kFloor * float ((2 * radius_ + 1) * (2 * radius_ + 1));
  float *credible = credible_.row (y);
  for (int x = 0; x < width; x++)
    credible[x] =
        fade (still[x] / (floor + moved[x]), kStillError, kMovedError);
}

void
Stillness::take (const Kernels &kernels, const Field &coded, const Field *after,
    const NoiseMap &noise)
{
  const int width = coded.width (), height = coded.height ();
  if (begun_)
    judge (kernels, coded, mean_, &count_, noise, false);
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
  if (after)
    judge (kernels, *after, coded, nullptr, noise, true);
  begun_ = true;
}

} // namespace cexp::fuse

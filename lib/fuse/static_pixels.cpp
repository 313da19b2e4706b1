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
constexpr Fade kMeanChange{1.8f, 3.0f};
/* The same for the largest squared change: a small object may have passed. */
constexpr Fade kLargestChange{25.0f, 40.0f};
/* Ratio of the prediction errors if static and if moving, up to which nothing
 * repeats, and from which on it does. */
constexpr Fade kRepetition{1.3f, 1.8f};
/* Of the noise of static light, how much is not in its estimates, too. */
constexpr float kOwnNoise = 0.6f;
/* Pixels with more weight are static. */
constexpr float kStatic = 0.5f;

} // namespace

StaticPixels::StaticPixels (
    int width, int height, int radius, bool average, float largest)
    : radius_ (radius), average_ (average), steps_ (65535.0f / largest),
      rooms_ (1, {Field (width, 1, radius), BoxFilter (width, height, radius),
                     BoxFilter (width, height, radius)}),
      unrepeated_ (std::max (width / 2, 1), std::max (height / 2, 1)),
      weight_ (width, height), unchanged_ (width, height)
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

void
StaticPixels::make_room (int count)
{
  rooms_.resize (std::size_t (count), rooms_.front ());
}

/* Sets @rating by the differences of @now from @other. @count: frames of which
 * @other is the mean. */
void
StaticPixels::compare_frames (const Kernels &kernels, const Field &now,
    const Field &other, const Field *count, const NoiseMap &noise, Rows rows,
    Field &rating)
{
  auto &[changes, sums, maxima] = rooms_[std::size_t (rows.worker)];
  const int width = now.width (), height = now.height ();
  const float area = float ((2 * radius_ + 1) * (2 * radius_ + 1));
  float *change = changes.row (0);
  for (int y = std::max (rows.first - radius_, 0); y < rows.end + radius_;
       y++) {
    if (y < height) {
      const int noise_row = y % noise.slope.height ();
      kernels.compare ({now.row (y), other.row (y), noise.slope.row (noise_row),
                           noise.offset.row (noise_row),
                           count ? count->row (y) : nullptr, kFloor, width},
          change);
      sums.extend (change);
      sums.add_row (kernels.sum, y, change);
      maxima.add_row (kernels.max, y, change);
    }
    const int out = y - radius_;
    if (out >= rows.first)
      kernels.rate (
          {sums.result (kernels.sum, out), maxima.result (kernels.max, out),
              unrepeated_.row (std::min (out / 2, unrepeated_.height () - 1)),
              area, kMeanChange, kLargestChange, width},
          rating.row (out));
  }
}

void
StaticPixels::set_errors (const Kernels &kernels, int row, int area,
    const float *if_static, const float *if_moving)
{
  float *unrepeated = unrepeated_.row (row);
  const int width = unrepeated_.width ();
  kernels.fade_ratio (if_static, if_moving, kFloor * float (area), kRepetition,
      width, unrepeated);
  unrepeated[width] = unrepeated[width - 1];
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
StaticPixels::compare (const Kernels &kernels, const Frames &frames, Rows rows)
{
  const auto &[coded, before, after, noise] = frames;
  if (!before) {
    for (int y = rows.first; y < rows.end; y++)
      std::fill_n (weight_.row (y), coded.width (), 0.0f);
    return;
  }
  const Field &other = average_ ? mean_ : *before;
  compare_frames (kernels, coded, other, average_ ? &count_ : nullptr, noise,
      rows, weight_);
  if (average_ && !compared_)
    compare_frames (kernels, coded, *before, nullptr, noise, rows, unchanged_);
}

void
StaticPixels::average (const Kernels &kernels, const Frames &frames, Rows rows)
{
  const auto &[coded, before, after, noise] = frames;
  const int width = coded.width ();
  if (average_)
    for (int y = rows.first; y < rows.end; y++)
      average_row (y, coded.row (y));
  if (!after)
    return;
  compare_frames (kernels, *after, coded, nullptr, noise, rows, unchanged_);
  for (int y = rows.first; y < rows.end; y++) {
    const float *unchanged = unchanged_.row (y);
    float *weight = weight_.row (y);
    for (int x = 0; x < width; x++)
      weight[x] = std::max (weight[x], unchanged[x]);
  }
}

void
StaticPixels::smooth (
    const Kernels &kernels, const Frames &frames, Field &light)
{
  auto &[differences, sums, maxima] = rooms_.front ();
  const int width = light.width (), height = light.height ();
  const float area = float ((2 * radius_ + 1) * (2 * radius_ + 1));
  const NoiseMap &noise = frames.noise;
  float *squared = differences.row (0);
  for (int y = 0; y < height + radius_; y++) {
    if (y < height) {
      const float *own = this->light (frames.coded, y), *other = light.row (y);
      for (int x = 0; x < width; x++)
        squared[x] = (own[x] - other[x]) * (own[x] - other[x]);
      sums.extend (squared);
      sums.add_row (kernels.sum, y, squared);
    }
    const int out = y - radius_;
    if (out < 0)
      continue;
    const float *own = this->light (frames.coded, out);
    const float *around = sums.result (kernels.sum, out);
    const float *slope = noise.slope.row (out % noise.slope.height ());
    const float *offset = noise.offset.row (out % noise.slope.height ());
    float *to = light.row (out);
    for (int x = 0; x < width; x++) {
      const float variance = (slope[x] * std::max (to[x], 0.0f) + offset[x]) /
                             this->frames (x, out);
      const float seen = around[x] / area + kFloor;
      to[x] += std::max (1.0f - kOwnNoise * variance / seen, 0.0f) *
               (own[x] - to[x]);
    }
  }
}

void
StaticPixels::finish (const Frames &frames)
{
  frames_++;
  compared_ = frames.after != nullptr;
}

} // namespace codedexposure::fuse

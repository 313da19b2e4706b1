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
/* Of the noise of static light, how much is not in its estimates, too. */
constexpr float kOwnNoise = 0.6f;
/* Pixels with more weight are static. */
constexpr float kStatic = 0.5f;
/* Rows that a thread takes at a time, at least. */
constexpr int kMinRows = 16;
/* Light of white in fields. */
constexpr double kWhite = 255.0;

} // namespace

NoiseMap::NoiseMap (
    const Schedule &schedule, const Observation &observation, Extent size)
    : slope (size.width, std::min (size.height, schedule.tile ().period_y ())),
      offset (slope)
{
  for (int y = 0; y < slope.height (); y++)
    for (int x = 0; x < size.width; x++) {
      const int element = schedule.element_at (x, y);
      const double dark = observation.variance (element, 0.0);
      const double white = observation.variance (element, 1.0);
      slope.row (y)[x] = float ((white - dark) * kWhite);
      offset.row (y)[x] = float (dark * kWhite * kWhite);
    }
}

StaticPixels::StaticPixels (const Kernels &kernels, const NoiseMap &noise,
    Extent size, int radius, bool average, float largest)
    : kernels_ (kernels), noise_ (noise), radius_ (radius), average_ (average),
      steps_ (65535.0f / largest),
      rooms_ (1, {Field (size.width, 1, radius),
                     BoxFilter (size.width, size.height, radius),
                     BoxFilter (size.width, size.height, radius)}),
      weight_ (size.width, size.height), unchanged_ (size.width, size.height)
{
  if (!average)
    return;
  for (Field *field : {&mean_, &count_, &light_})
    *field = Field (size.width, size.height);
  sum_.resize (std::size_t (size.width) * std::size_t (size.height));
  past_.resize (sum_.size () * kMemory);
}

/* Sets @rating by the differences of the frames of @pair. */
void
StaticPixels::compare (const Pair &pair, const Band &band, Field &rating)
{
  const auto &[now, other, count, unrepeated] = pair;
  auto &[changes, sums, maxima] = rooms_[std::size_t (band.worker)];
  const int width = now.width (), height = now.height ();
  const float area = float ((2 * radius_ + 1) * (2 * radius_ + 1));
  float *change = changes.row (0);
  for (int y = std::max (band.first - radius_, 0); y < band.end + radius_;
       y++) {
    if (y < height) {
      kernels_.compare (
          {now.row (y), other.row (y), noise_.slopes (y), noise_.offsets (y),
              count ? count->row (y) : nullptr, kFloor, width},
          change);
      sums.extend (change);
      sums.add_row (kernels_.sum, y, change);
      maxima.add_row (kernels_.max, y, change);
    }
    const int out = y - radius_;
    if (out >= band.first)
      kernels_.rate (
          {sums.result (kernels_.sum, out), maxima.result (kernels_.max, out),
              unrepeated.row (std::min (out / 2, unrepeated.height () - 1)),
              area, kMeanChange, kLargestChange, width},
          rating.row (out));
  }
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
  std::uint16_t *past = past_.data () + // the oldest
                        std::size_t (frames_ % kMemory) * sum_.size () +
                        std::size_t (y) * std::size_t (width);
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

StaticPixels::Found
StaticPixels::take (
    const CodedFrames &frames, const Field &unrepeated, const Task &task)
{
  const Field &now = frames.now->light;
  const int width = now.width (), height = now.height ();
  rooms_.resize (std::size_t (task.workers.count ()), rooms_.front ());
  const auto compare_with_past = [&] (const Band &band) {
    if (!frames.before) {
      for (int y = band.first; y < band.end; y++)
        std::fill_n (weight_.row (y), width, 0.0f);
      return;
    }
    const Field &before = frames.before->light;
    if (!average_)
      return compare ({now, before, nullptr, unrepeated}, band, weight_);
    compare ({now, mean_, &count_, unrepeated}, band, weight_);
    if (!compared_)
      compare ({now, before, nullptr, unrepeated}, band, unchanged_);
  };
  const auto add = [&] (const Band &band) {
    for (int y = band.first; average_ && y < band.end; y++)
      average_row (y, now.row (y));
    if (!frames.after)
      return;
    compare ({frames.after->light, now, nullptr, unrepeated}, band, unchanged_);
    for (int y = band.first; y < band.end; y++) {
      const float *unchanged = unchanged_.row (y);
      float *weight = weight_.row (y);
      for (int x = 0; x < width; x++)
        weight[x] = std::max (weight[x], unchanged[x]);
    }
  };
  run_bands (task, height, kMinRows, compare_with_past);
  run_bands (task, height, kMinRows, add);
  frames_++;
  compared_ = frames.after != nullptr;
  if (average_)
    return {weight_, light_, &mean_, &count_};
  return {weight_, now, nullptr, nullptr};
}

void
StaticPixels::smooth (const Found &found, Field &light)
{
  auto &[differences, sums, maxima] = rooms_.front ();
  const int width = light.width (), height = light.height ();
  const float area = float ((2 * radius_ + 1) * (2 * radius_ + 1));
  float *squared = differences.row (0);
  for (int y = 0; y < height + radius_; y++) {
    if (y < height) {
      const float *own = found.light.row (y), *other = light.row (y);
      for (int x = 0; x < width; x++)
        squared[x] = (own[x] - other[x]) * (own[x] - other[x]);
      sums.extend (squared);
      sums.add_row (kernels_.sum, y, squared);
    }
    const int out = y - radius_;
    if (out < 0)
      continue;
    const float *own = found.light.row (out);
    const float *around = sums.result (kernels_.sum, out);
    const float *slope = noise_.slopes (out), *offset = noise_.offsets (out);
    float *to = light.row (out);
    for (int x = 0; x < width; x++) {
      const float variance = (slope[x] * std::max (to[x], 0.0f) + offset[x]) /
                             found.frames (x, out);
      const float seen = around[x] / area + kFloor;
      to[x] += std::max (1.0f - kOwnNoise * variance / seen, 0.0f) *
               (own[x] - to[x]);
    }
  }
}

} // namespace codedexposure::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/likeness.h"

#include <algorithm>
#include <cmath>

#include "fuse/dct_matrix.h"

namespace cexp::fuse
{

namespace
{

constexpr int kBorder = kBlock;
constexpr int kIterations = 40;
/* Thresholds in grey levels, of the first iteration and of the last without
 * noise; with noise, the last is as many standard deviations. */
constexpr double kFirstThreshold = 30.0, kLastThreshold = 2.0;
constexpr double kNoiseThreshold = 1.8;

int
round_up (int value, int step)
{
  return (value + step - 1) / step * step;
}

} // namespace

Likeness::Likeness (const Schedule &schedule, const Observation &observation,
    int width, int height)
    : observation_ (observation), width_ (width), height_ (height),
      split_ (round_up (width + 2 * kBorder, kBlockStep * Field::kSlack) /
                  kBlockStep +
              kBlock / kBlockStep + 1),
      stride_ (split_ * kBlockStep),
      transform_ (dct_matrix (observation.slots ()))
{
  const auto area = std::size_t (stride_) * std::size_t (height + 2 * kBorder);
  const auto slots = std::size_t (observation.slots ());
  elements_.resize (area);
  coded_.resize (area);
  weight_.resize (area);
  light_.assign (slots, std::vector<float> (area));
  sum_ = light_;
  scratch_.resize (slots * kBlock * kBlock * Field::kSlack);
  for (int y = -kBorder; y < height + kBorder; y++)
    for (int x = -kBorder; x < int (stride_) - kBorder; x++)
      elements_[place (x, y)] = std::uint8_t (
          schedule.element_at (mirrored (x, width), mirrored (y, height)));
}

std::size_t
Likeness::place (int x, int y) const
{
  const int column = x + kBorder;
  return std::size_t ((y + kBorder) * stride_ + (column % kBlockStep) * split_ +
                      column / kBlockStep);
}

void
Likeness::split (const Field &field, std::vector<float> &plane) const
{
  for (int y = -kBorder; y < height_ + kBorder; y++) {
    const float *row = field.row (mirrored (y, height_));
    /* To the end of the row: the last blocks reach beyond the border. */
    for (int x = -kBorder; x < int (stride_) - kBorder; x++)
      plane[place (x, y)] = row[mirrored (x, width_)];
  }
}

/* Blocks begin at another pixel in each iteration. */
void
Likeness::shrink (const Kernels &kernels, int iteration, float threshold)
{
  for (auto &sum : sum_)
    std::fill (sum.begin (), sum.end (), 0.0f);
  std::fill (weight_.begin (), weight_.end (), 0.0f);

  const int shift_y = iteration % kBlockStep;
  const int shift_x = (iteration / 2 + 2 * iteration) % kBlockStep;
  const std::size_t slots = light_.size ();
  std::vector<const float *> source (slots);
  std::vector<float *> sum (slots);
  const int blocks =
      round_up ((width_ + kBorder - shift_x + kBlockStep - 1) / kBlockStep,
          Field::kSlack);
  for (int y = shift_y; y + kBlock <= height_ + 2 * kBorder; y += kBlockStep) {
    const std::ptrdiff_t start = y * stride_;
    for (std::size_t s = 0; s < slots; s++) {
      source[s] = light_[s].data () + start;
      sum[s] = sum_[s].data () + start;
    }
    kernels.shrink ({source.data (), sum.data (), weight_.data () + start,
        stride_, split_, shift_x, int (slots), transform_.data (), blocks,
        threshold, scratch_.data ()});
  }
  for (std::size_t s = 0; s < slots; s++) {
    float *light = light_[s].data ();
    const float *total = sum_[s].data ();
    for (std::size_t i = 0; i < weight_.size (); i++)
      light[i] = weight_[i] > 0.0f ? total[i] / weight_[i] : light[i];
  }
}

/* Moves the light of each pixel's slots to where the coded pixel is what it
 * was. */
void
Likeness::put_back ()
{
  for (std::size_t i = 0; i < coded_.size (); i++) {
    const auto &shares = observation_.shares (elements_[i]);
    double seen = 0.0, power = 0.0;
    for (const auto &[slot, response] : shares) {
      seen += response * light_[std::size_t (slot)][i];
      power += response * response;
    }
    const double step = (coded_[i] - seen) / power;
    for (const auto &[slot, response] : shares)
      light_[std::size_t (slot)][i] += float (step * response);
  }
}

void
Likeness::run (const Kernels &kernels, const Field &coded, double noise,
    std::span<Field> slots)
{
  split (coded, coded_);
  for (std::size_t s = 0; s < slots.size (); s++)
    split (slots[s], light_[s]);

  const double last = std::max (kLastThreshold, kNoiseThreshold * noise);
  const double first = std::max (kFirstThreshold, 2.0 * last);
  for (int i = 0; i < kIterations; i++) {
    const double threshold =
        first * std::pow (last / first, double (i) / (kIterations - 1));
    shrink (kernels, i, float (threshold));
    put_back ();
  }
  for (std::size_t s = 0; s < slots.size (); s++) {
    for (int y = 0; y < height_; y++) {
      float *row = slots[s].row (y);
      for (int x = 0; x < width_; x++)
        row[x] = 0.5f * (row[x] + light_[s][place (x, y)]);
    }
  }
}

} // namespace cexp::fuse

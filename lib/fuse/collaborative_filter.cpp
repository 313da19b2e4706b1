/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/collaborative_filter.h"

#include <algorithm>
#include <cmath>

#include "fuse/dct.h"

namespace codedexposure::fuse
{

namespace
{

constexpr int kBorder = kBlock;
constexpr int kIterations = 29;
/* An iteration goes this many times as far as from an estimate to the mean of
 * its shrunk blocks, so that fewer are needed. */
constexpr float kStep = 1.6f;
/* The last ones go just there: what remains of single blocks is not enlarged.
 */
constexpr int kLastIterations = 2;
/* The thresholds' logarithm falls with this power of the iteration. */
constexpr double kSlowing = 1.2;
/* Thresholds of the first and the last iteration, in grey levels; with noise,
 * the last one is kNoiseThreshold standard deviations at least. */
constexpr double kFirstThreshold = 30.0, kLastThreshold = 2.0;
constexpr double kNoiseThreshold = 1.8;
/* With a partner, the first estimate is better. */
constexpr double kFirstWithPartner = 20.0;
/* Of the result in the mean with the estimate that it began with. */
constexpr float kShare = 0.4f;
/* No slot. */
constexpr std::uint8_t kNotMeasured = 255;
/* Rows of blocks that are shrunk, and rows of pixels that are updated, at a
 * time. Strips of blocks overlap the next ones only. */
constexpr int kStripBlocks = 4;
constexpr int kStripRows = 24;
static_assert (kStripBlocks * kBlockStep >= kBlock - kBlockStep);

int
round_up (int value, int step)
{
  return (value + step - 1) / step * step;
}

} // namespace

CollaborativeFilter::CollaborativeFilter (const Kernels &kernels,
    const Schedule &schedule, const Observation &observation,
    const Observation *partner, int width, int height)
    : kernels_ (kernels), observation_ (observation), partner_ (partner),
      width_ (width), height_ (height),
      split_ (
          round_up (round_up (width + 2 * kBorder, kBlockStep * Field::kSlack) /
                            kBlockStep +
                        kBlock / kBlockStep + 1,
              Field::kSlack)),
      stride_ (split_ * kBlockStep),
      transform_ (dct_matrix (observation.slots ()))
{
  const auto area = std::size_t (stride_) * std::size_t (height + 2 * kBorder);
  const auto slots = std::size_t (observation.slots ());
  elements_.resize (area);
  measured_.resize (area);
  coded_.resize (area);
  weight_.resize (area);
  light_.assign (slots, std::vector<float> (area));
  sum_ = light_;
  for (int y = -kBorder; y < height + kBorder; y++)
    for (int x = -kBorder; x < int (stride_) - kBorder; x++) {
      const int element =
          schedule.element_at (mirrored (x, width), mirrored (y, height));
      elements_[place (x, y)] = std::uint8_t (element);
      measured_[place (x, y)] =
          observation.exact ()
              ? std::uint8_t (observation.shares (element)[0].slot)
              : kNotMeasured;
    }
}

std::size_t
CollaborativeFilter::place (int x, int y) const
{
  const int column = x + kBorder;
  return std::size_t ((y + kBorder) * stride_ + (column % kBlockStep) * split_ +
                      column / kBlockStep);
}

void
CollaborativeFilter::split (const Field &field, std::vector<float> &plane) const
{
  for (int y = -kBorder; y < height_ + kBorder; y++) {
    const float *row = field.row (mirrored (y, height_));
    /* To the end of the row, as the last blocks reach beyond the border. */
    for (int x = -kBorder; x < int (stride_) - kBorder; x++)
      plane[place (x, y)] = row[mirrored (x, width_)];
  }
}

/* Blocks begin at a different pixel in each iteration. */
struct CollaborativeFilter::Step {
  int shift_x, shift_y;
  float threshold;
  float length;     ///< as kStep
  float of_partner; ///< how far to go towards what it saw
};

void
CollaborativeFilter::shrink_strip (const Step &step, int strip, float *scratch)
{
  const std::size_t slots = light_.size ();
  std::vector<const float *> source (slots);
  std::vector<float *> sum (slots);
  const int blocks =
      round_up ((width_ + kBorder - step.shift_x + kBlockStep - 1) / kBlockStep,
          Field::kSlack);
  for (int i = 0; i < kStripBlocks; i++) {
    const int y = step.shift_y + (strip * kStripBlocks + i) * kBlockStep;
    if (y + kBlock > height_ + 2 * kBorder)
      return;
    const std::ptrdiff_t start = y * stride_;
    for (std::size_t s = 0; s < slots; s++) {
      source[s] = light_[s].data () + start;
      sum[s] = sum_[s].data () + start;
    }
    kernels_.shrink ({source.data (), sum.data (), weight_.data () + start,
        stride_, split_, step.shift_x, int (slots), transform_.data (), blocks,
        step.threshold, scratch});
  }
}

/* Every other strip first, then those between: no two workers add to the same
 * pixel, and each pixel's sum has the same order with any number of them. */
void
CollaborativeFilter::shrink (const Step &step, const Task &task)
{
  const int rows = (height_ + 2 * kBorder - kBlock - step.shift_y) / kBlockStep;
  const int strips = rows / kStripBlocks + 1;
  for (const int odd : {0, 1})
    task.run ((strips + 1 - odd) / 2, [&] (int part, int worker) {
      shrink_strip (
          step, 2 * part + odd, scratch_[std::size_t (worker)].data ());
    });
  const int height = height_ + 2 * kBorder;
  task.run ((height + kStripRows - 1) / kStripRows, [&] (int part, int) {
    update_rows (
        step, part * kStripRows, std::min (height, (part + 1) * kStripRows));
  });
}

/* The light of rows @first .. @end - 1 from the sums, which are cleared, such
 * that it gives the coded pixels that were measured. */
void
CollaborativeFilter::update_rows (const Step &step, int first, int end)
{
  std::vector<float *> light, sum;
  for (std::size_t s = 0; s < light_.size (); s++) {
    light.push_back (light_[s].data () + first * stride_);
    sum.push_back (sum_[s].data () + first * stride_);
  }
  const auto at = first * stride_;
  kernels_.settle ({light.data (), sum.data (), weight_.data () + at,
      coded_.data () + at, measured_.data () + at, int (light_.size ()),
      int ((end - first) * stride_), step.length});
  if (!observation_.exact ())
    correct_rows (first, end, observation_, coded_, 1.0f);
  if (step.of_partner > 0.0f)
    correct_rows (first, end, *partner_, of_partner_, step.of_partner);
}

/* Pixels @seen that several slots share. */
void
CollaborativeFilter::correct_rows (int first, int end,
    const Observation &observation, const std::vector<float> &seen, float part)
{
  const auto from = std::size_t (first * stride_);
  const auto to = std::size_t (end * stride_);
  for (std::size_t i = from; i < to; i++) {
    const auto &shares = observation.shares (elements_[i]);
    double made = 0.0, power = 0.0;
    for (const auto &[slot, response] : shares) {
      made += response * light_[std::size_t (slot)][i];
      power += response * response;
    }
    const double step = part * (seen[i] - made) / power;
    for (const auto &[slot, response] : shares)
      light_[std::size_t (slot)][i] += float (step * response);
  }
}

void
CollaborativeFilter::run (const Field &coded, const Field *partner,
    double noise, std::span<Field> slots, const Task &task)
{
  scratch_.resize (std::size_t (task.workers.count ()));
  for (auto &scratch : scratch_)
    scratch.resize (slots.size () * kBlock * kBlock * Field::kSlack);
  split (coded, coded_);
  of_partner_.resize (partner ? coded_.size () : 0);
  if (partner)
    split (*partner, of_partner_);
  /* The estimate is nearer to the truth than a measurement whose noise is large
   * beside the threshold. The slots of a partner's pixel have together as much
   * noise as one has in a coded pixel. */
  const auto towards_partner = [&] (double threshold) {
    const double square = threshold * threshold;
    return partner ? float (square / (square + 4.0 * noise * noise)) : 0.0f;
  };
  for (std::size_t s = 0; s < slots.size (); s++) {
    split (slots[s], light_[s]);
    std::fill (sum_[s].begin (), sum_[s].end (), 0.0f);
  }
  std::fill (weight_.begin (), weight_.end (), 0.0f);

  const double last = std::max (kLastThreshold, kNoiseThreshold * noise);
  const double first =
      std::max (partner ? kFirstWithPartner : kFirstThreshold, 2.0 * last);
  for (int i = 0; i < kIterations; i++) {
    const double threshold =
        first * std::pow (last / first,
                    std::pow (double (i) / (kIterations - 1), kSlowing));
    shrink ({(i / 2 + 2 * i) % kBlockStep, i % kBlockStep, float (threshold),
                i < kIterations - kLastIterations ? kStep : 1.0f,
                towards_partner (threshold)},
        task);
  }
  for (std::size_t s = 0; s < slots.size (); s++) {
    for (int y = 0; y < height_; y++) {
      float *row = slots[s].row (y);
      for (int x = 0; x < width_; x++)
        row[x] += kShare * (light_[s][place (x, y)] - row[x]);
    }
  }
}

} // namespace codedexposure::fuse

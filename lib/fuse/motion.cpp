/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "estimate/kriging.h"

namespace codedexposure::fuse
{

namespace
{

/* Surroundings over which the error of a class is averaged. */
constexpr double kSigma = 2.5;
constexpr int kReach = 8;
/* Rows that a worker takes at a time. */
constexpr int kBandRows = 48;
/* Classes whose error is measured at a time: the outputs of one pass of a
 * filter.
 */
constexpr std::size_t kChunk = 8;
/* Errors of this size, in grey levels squared, do not tell classes apart. */
constexpr float kErrorFloor = 1.0f;
/* Classes with less weight relative to the best one are left out. */
constexpr float kMinWeight = 0.01f;

std::vector<float>
gaussian ()
{
  std::vector<float> weights;
  double sum = 0.0;
  for (int i = -kReach; i <= kReach; i++)
    sum += std::exp (-0.5 * i * i / (kSigma * kSigma));
  for (int i = -kReach; i <= kReach; i++)
    weights.push_back (
        float (std::exp (-0.5 * i * i / (kSigma * kSigma)) / sum));
  return weights;
}

/* A filter of one output with the same weights everywhere. */
class Blur
{
public:
  Blur ()
  {
    for (const float weight : gaussian ())
      weights_.insert (weights_.end (), Field::kSlack, weight);
    static_assert (Field::kSlack >= 16, "a row of weights is a vector long");
  }
  void run (const Kernels &kernels, const float *source, std::ptrdiff_t step,
      int count, float *to) const
  {
    std::array<std::ptrdiff_t, 2 * kReach + 1> offsets;
    for (int i = -kReach; i <= kReach; i++)
      offsets[std::size_t (i + kReach)] = i * step;
    kernels.filter ({source, count, offsets.data (), int (offsets.size ()),
                        weights_.data (), Field::kSlack, 1, 1, 0},
        &to);
  }

private:
  std::vector<float> weights_;
};

} // namespace

/* Rows first .. first + rows - 1 of a frame that is being filtered. */
struct MotionFilter::Band {
  Band (int width, std::size_t classes)
      : fit (classes, Field (width, kBandRows)),
        squares (kChunk, Field (width, kBandRows, kReach)),
        along (width, kBandRows + 2 * kReach)
  {
  }

  int first = 0, rows = 0;
  std::vector<Field> fit;     ///< of each class: error, then weight
  std::vector<Field> squares; ///< of a chunk: squared residuals
  Field along;                ///< blurred along x
};

MotionFilter::MotionFilter (const Phases &phases,
    const Observation &observation, std::span<const SceneClass> classes,
    int radius, std::span<const double> noise, float steps)
    : phases_ (phases)
{
  const std::vector<Tap> taps = taps_within (radius + 0.5);
  for (std::size_t c = 0; c < classes.size (); c++) {
    const SceneClass &patch = classes[c];
    if (c % kChunk == 0)
      residuals_.emplace_back (
          phases, taps, int (std::min (kChunk, classes.size () - c)), steps);
    penalties_.push_back (float (1.0 + 0.1 * std::hypot (patch.vx, patch.vy)));
    filters_.emplace_back (phases, taps, observation.slots (), steps);
    for_each_phase (phases, observation, patch, taps, noise,
        [&] (int row, int x, const PhaseWeights &weights) {
          filters_.back ().set_all (row, x, weights.slots);
          residuals_.back ().set (row, x, int (c % kChunk), weights.residual);
        });
  }
}

/* The squared error of every class around each pixel of the band. */
void
MotionFilter::measure (
    const Kernels &kernels, const PairField &coded, Band &band) const
{
  const Blur blur;
  const int width = coded.width (), height = coded.height ();
  std::vector<const std::int32_t *> sources;
  const PairFrames frames{nullptr, &coded, nullptr};
  for (std::size_t c = 0; c < band.fit.size (); c += kChunk) {
    const std::size_t count = std::min (kChunk, band.fit.size () - c);
    for (int y = -kReach; y < band.rows + kReach; y++) {
      std::array<float *, kChunk> to;
      for (std::size_t i = 0; i < count; i++)
        to[i] = band.squares[i].row (y);
      kernels.filter_pairs_squared (
          residuals_[c / kChunk].row (
              phases_, frames, mirrored (band.first + y, height), sources),
          to.data ());
    }
    for (std::size_t i = 0; i < count; i++) {
      Field &squares = band.squares[i];
      for (int y = -kReach; y < band.rows + kReach; y++) {
        float *square = squares.row (y);
        for (int x = 1; x <= kReach; x++) {
          square[-x] = square[mirrored (-x, width)];
          square[width - 1 + x] = square[mirrored (width - 1 + x, width)];
        }
        blur.run (kernels, square, 1, width, band.along.row (y + kReach));
      }
      for (int y = 0; y < band.rows; y++)
        blur.run (kernels, band.along.row (y + kReach), band.along.stride (),
            width, band.fit[c + i].row (y));
    }
  }
}

/* Weights (best error / error) ^ 12.5, the number of independent errors in the
 * surroundings being some 25. */
void
MotionFilter::set_weights (Band &band, Field *misfit) const
{
  const int width = band.along.width ();
  Field room (width, 2);
  float *const best = room.row (0), *const sum = room.row (1);
  for (int y = 0; y < band.rows; y++) {
    std::fill_n (best, width, 1e30f);
    std::fill_n (sum, width, 0.0f);
    for (std::size_t c = 0; c < band.fit.size (); c++) {
      float *fit = band.fit[c].row (y);
      for (int x = 0; x < width; x++) {
        fit[x] = penalties_[c] * fit[x] + kErrorFloor;
        best[x] = std::min (best[x], fit[x]);
      }
    }
    if (misfit)
      std::copy_n (best, width, misfit->row (band.first + y));
    for (Field &field : band.fit) {
      float *fit = field.row (y);
      for (int x = 0; x < width; x++) {
        const float ratio = best[x] / fit[x];
        const float fourth = ratio * ratio * ratio * ratio;
        const float weight = fourth * fourth * fourth * std::sqrt (ratio);
        fit[x] = weight < kMinWeight ? 0.0f : weight;
        sum[x] += fit[x];
      }
    }
    for (Field &field : band.fit) {
      float *fit = field.row (y);
      for (int x = 0; x < width; x++)
        fit[x] /= sum[x];
    }
  }
}

void
MotionFilter::mix (const Kernels &kernels, const PairField &coded,
    const Band &band, std::span<Field> slots) const
{
  std::vector<const std::int32_t *> sources;
  const PairFrames frames{nullptr, &coded, nullptr};
  std::vector<float *> to (slots.size ());
  for (Field &slot : slots)
    for (int y = 0; y < band.rows; y++)
      std::fill_n (slot.row (band.first + y), coded.width (), 0.0f);
  for (std::size_t c = 0; c < filters_.size (); c++) {
    for (int y = 0; y < band.rows; y++) {
      for (std::size_t s = 0; s < slots.size (); s++)
        to[s] = slots[s].row (band.first + y);
      kernels.filter_pairs_add (
          filters_[c].row (phases_, frames, band.first + y, sources),
          band.fit[c].row (y), to.data ());
    }
  }
}

bool
MotionFilter::run (const Kernels &kernels, const PairField &coded,
    std::span<Field> slots, Field *misfit, Workers &workers,
    std::stop_token stop) const
{
  const int height = coded.height ();
  std::vector<std::optional<Band>> bands (std::size_t (workers.count ()));
  return workers.run ((height + kBandRows - 1) / kBandRows,
      [&] (int part, int worker) {
        auto &band = bands[std::size_t (worker)];
        if (!band)
          band.emplace (coded.width (), filters_.size ());
        band->first = part * kBandRows;
        band->rows = std::min (kBandRows, height - band->first);
        measure (kernels, coded, *band);
        set_weights (*band, misfit);
        mix (kernels, coded, *band, slots);
      },
      stop);
}

} // namespace codedexposure::fuse

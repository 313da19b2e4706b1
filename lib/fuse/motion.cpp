/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimate/kriging.h"

namespace codedexposure::fuse
{

namespace
{

/* Surroundings over which the error of a class is averaged. */
constexpr double kSigma = 3.2;
constexpr int kReach = 10;
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
  Band (int width, const std::vector<float> &factors_of_classes)
      : factors (factors_of_classes),
        fit (factors.size (), Field (width, kBandRows)),
        squares (kChunk, Field (width, kBandRows, kReach)),
        along (width, kBandRows + 2 * kReach)
  {
  }

  int first = 0, rows = 0;
  std::vector<float> factors; ///< of each class
  std::vector<Field> fit;     ///< of each class: error, then weight
  std::vector<Field> squares; ///< of a chunk: squared residuals
  Field along;                ///< blurred along x
};

MotionFilter::MotionFilter (const Phases &phases,
    const Observation &observation, Classes classes, int radius,
    std::span<const double> noise, float steps)
    : phases_ (phases), observation_ (observation),
      classes_ (std::move (classes)), radius_ (radius),
      noise_ (noise.begin (), noise.end ()), steps_ (steps),
      of_frame_ (make_set (classes_.of_frame, taps_within (radius + 0.5)))
{
}

/* Under a class whose motion brings several samples to the same places of the
 * patch, pixels are predicted well and the gaps between these places are not.
 * Errors therefore count by how much larger the class expects those of the
 * slots to be. Half of this ratio's logarithm, as gaps are easier to fill than
 * the class says where light changes along one direction only. */
MotionFilter::Set
MotionFilter::make_set (
    std::span<const SceneClass> classes, std::span<const Tap> taps) const
{
  Set set;
  for (std::size_t c = 0; c < classes.size (); c++) {
    const SceneClass &patch = classes[c];
    if (c % kChunk == 0)
      set.residuals.emplace_back (
          phases_, taps, int (std::min (kChunk, classes.size () - c)), steps_);
    FilterBank &filter =
        set.filters.emplace_back (phases_, taps, observation_.slots (), steps_);
    double predicted = 0.0, sought = 0.0;
    for_each_phase (phases_, observation_, patch, taps, noise_,
        [&] (int row, int x, const PhaseWeights &weights) {
          filter.set_all (row, x, weights.slots);
          set.residuals.back ().set (
              row, x, int (c % kChunk), weights.residual);
          predicted += weights.predicted_variance;
          sought += weights.slot_variance;
        });
    set.factors.push_back (float (std::sqrt (sought / predicted)));
  }
  return set;
}

const MotionFilter::Set *
MotionFilter::set_over (const PairFrames &frames)
{
  const bool previous = frames[0] != nullptr, next = frames[2] != nullptr;
  if (!previous && !next)
    return nullptr;
  auto &set = over_frames_[(previous ? 1u : 0u) + (next ? 2u : 0u)];
  if (!set)
    set = make_set (classes_.over_frames,
        taps_around (radius_ + 0.5, kNeighbourRadius, previous, next));
  return &*set;
}

/* The squared error of every class around each pixel of the band. */
void
MotionFilter::measure (const Kernels &kernels, const PairFrames &frames,
    const Set &set, Band &band, std::span<Field> fit) const
{
  const Blur blur;
  const int width = frames[1]->width (), height = frames[1]->height ();
  std::vector<const std::int32_t *> sources;
  for (std::size_t c = 0; c < fit.size (); c += kChunk) {
    const std::size_t count = std::min (kChunk, fit.size () - c);
    for (int y = -kReach; y < band.rows + kReach; y++) {
      std::array<float *, kChunk> to;
      for (std::size_t i = 0; i < count; i++)
        to[i] = band.squares[i].row (y);
      kernels.filter_pairs_squared (
          set.residuals[c / kChunk].row (
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
      for (int y = 0; y < band.rows; y++) {
        float *error = fit[c + i].row (y);
        blur.run (kernels, band.along.row (y + kReach), band.along.stride (),
            width, error);
      }
    }
  }
}

/* Weights (best error / error) ^ 8. Were the errors independent, the number of
 * those in the surroundings would ask for a power of some 20; but they are not,
 * and a mean of several filters is truer than the one that happens to fit best.
 */
void
MotionFilter::set_weights (Band &band, Field *misfit) const
{
  const int width = band.along.width ();
  Field room (width, 2);
  float *const best = room.row (0), *const sum = room.row (1);
  for (int y = 0; y < band.rows; y++) {
    std::fill_n (best, width, 1e30f);
    std::fill_n (sum, width, 0.0f);
    float *const raw = misfit ? misfit->row (band.first + y) : nullptr;
    for (std::size_t c = 0; c < band.fit.size (); c++) {
      float *fit = band.fit[c].row (y);
      for (int x = 0; x < width; x++) {
        const float error = fit[x] + kErrorFloor;
        fit[x] = band.factors[c] * fit[x] + kErrorFloor;
        if (fit[x] < best[x]) {
          best[x] = fit[x];
          if (raw)
            raw[x] = error;
        }
      }
    }
    for (Field &field : band.fit) {
      float *fit = field.row (y);
      for (int x = 0; x < width; x++) {
        const float ratio = best[x] / fit[x];
        const float fourth = ratio * ratio * ratio * ratio;
        const float weight = fourth * fourth;
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

/* Adds the slots of the classes of @set. */
void
MotionFilter::mix (const Kernels &kernels, const PairFrames &frames,
    const Set &set, const Band &band, std::span<const Field> fit,
    std::span<Field> slots) const
{
  std::vector<const std::int32_t *> sources;
  std::vector<float *> to (slots.size ());
  for (std::size_t c = 0; c < set.filters.size (); c++) {
    for (int y = 0; y < band.rows; y++) {
      for (std::size_t s = 0; s < slots.size (); s++)
        to[s] = slots[s].row (band.first + y);
      kernels.filter_pairs_add (
          set.filters[c].row (phases_, frames, band.first + y, sources),
          fit[c].row (y), to.data ());
    }
  }
}

bool
MotionFilter::run (const Kernels &kernels, const PairFrames &frames,
    std::span<Field> slots, Field *misfit, Workers &workers,
    std::stop_token stop)
{
  const int width = frames[1]->width (), height = frames[1]->height ();
  std::vector<const Set *> sets{&of_frame_};
  if (const Set *over = set_over (frames))
    sets.push_back (over);
  std::vector<float> factors;
  for (const Set *set : sets)
    std::ranges::copy (set->factors, std::back_inserter (factors));
  std::vector<std::optional<Band>> bands (std::size_t (workers.count ()));
  return workers.run ((height + kBandRows - 1) / kBandRows,
      [&] (int part, int worker) {
        auto &band = bands[std::size_t (worker)];
        if (!band)
          band.emplace (width, factors);
        band->first = part * kBandRows;
        band->rows = std::min (kBandRows, height - band->first);
        const auto each_set = [&] (const auto &use) {
          std::span<Field> fit (band->fit);
          for (const Set *set : sets) {
            use (*set, fit.first (set->filters.size ()));
            fit = fit.subspan (set->filters.size ());
          }
        };
        each_set ([&] (const Set &set, std::span<Field> fit) {
          measure (kernels, frames, set, *band, fit);
        });
        set_weights (*band, misfit);
        for (Field &slot : slots)
          for (int y = 0; y < band->rows; y++)
            std::fill_n (slot.row (band->first + y), width, 0.0f);
        each_set ([&] (const Set &set, std::span<Field> fit) {
          mix (kernels, frames, set, *band, fit, slots);
        });
      },
      stop);
}

} // namespace codedexposure::fuse

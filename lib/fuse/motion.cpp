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

/* Surroundings over which the error of a class is averaged, in blocks of 2x2
 * pixels: they are so much larger that classes are weighted block by block. */
constexpr double kSigma = 1.6;
constexpr int kReach = 5;
/* Rows of blocks that a worker takes at a time: many, as it computes errors of
 * 2 kReach more. */
constexpr int kBandRows = 48;
/* Classes whose error is measured at a time: the outputs of one pass of a
 * filter.
 */
constexpr std::size_t kChunk = 8;
/* Errors of this size, in grey levels squared, do not tell classes apart. */
constexpr float kErrorFloor = 1.0f;
/* Classes with less weight relative to the best one are left out. */
constexpr float kMinWeight = 0.01f;

/* Of both axes together 1/4, as sums of blocks become means of pixels. */
std::vector<float>
gaussian ()
{
  std::vector<float> weights;
  double sum = 0.0;
  for (int i = -kReach; i <= kReach; i++)
    sum += std::exp (-0.5 * i * i / (kSigma * kSigma));
  for (int i = -kReach; i <= kReach; i++)
    weights.push_back (
        float (0.5 * std::exp (-0.5 * i * i / (kSigma * kSigma)) / sum));
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

/* Rows first .. first + rows - 1 of the blocks of a frame that is filtered. */
struct MotionFilter::Band {
  Band (int width, const std::vector<float> &factors_of_classes)
      : factors (factors_of_classes), blocks ((width + 1) / 2),
        squares (width, 2 * kChunk, 2 * kReach),
        sums (kChunk, Field (blocks, kBandRows, kReach)),
        along (blocks, kBandRows + 2 * kReach),
        fit_rows (blocks, kBandRows * int (factors.size ()))
  {
  }

  /* Of class @c: error, then weight. Rows of all classes lie together, as they
   * are compared. */
  float *fit (std::size_t c, int y)
  {
    return fit_rows.row (y * int (factors.size ()) + int (c));
  }

  int first = 0, rows = 0;
  std::vector<float> factors; ///< of each class
  int blocks;                 ///< of a row
  Field squares;              ///< of a chunk: squared residuals of two rows
  std::vector<Field> sums;    ///< of a chunk: the same of blocks
  Field along;                ///< blurred along x
  Field fit_rows;
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

/* What moves uses one neighbouring frame: with both, filters of wrong motions
 * fit by chance more often, as they have more taps. */
std::vector<const MotionFilter::Set *>
MotionFilter::sets_for (const PairFrames &frames)
{
  const bool previous = frames[0] != nullptr, next = frames[2] != nullptr;
  if (!previous && !next)
    return {&of_frame_};
  const auto made = [&] (std::optional<Set> &set,
                        std::span<const SceneClass> classes, bool with_previous,
                        bool with_next) {
    if (!set)
      set = make_set (classes, taps_around (radius_ + 0.5, kNeighbourRadius,
                                   with_previous, with_next));
    return &*set;
  };
  return {&of_frame_,
      made (over_frames_[(previous ? 1u : 0u) + (next ? 2u : 0u)],
          classes_.over_frames, previous, next),
      made (
          over_one_[previous ? 0 : 1], classes_.over_one, previous, !previous)};
}

/* The squared residuals of a chunk of classes in all blocks of the band and
 * around it. */
void
MotionFilter::measure_blocks (const Kernels &kernels, const PairFrames &frames,
    const FilterBank &residuals, Band &band) const
{
  const int width = frames[1]->width (), height = frames[1]->height ();
  const auto count = std::size_t (residuals.outputs ());
  std::vector<const std::int32_t *> sources;
  for (int y = -kReach; y < band.rows + kReach; y++) {
    std::array<float *, 2 * kChunk> to;
    for (std::size_t i = 0; i < 2 * kChunk; i++)
      to[i] = band.squares.row (int (i));
    for (const int half : {0, 1})
      kernels.filter_pairs_squared (
          residuals.row (phases_, frames,
              mirrored (2 * (band.first + y) + half, height), sources),
          to.data () + (half ? kChunk : 0));
    for (std::size_t i = 0; i < count; i++) {
      for (float *square : {to[i], to[i + kChunk]})
        for (int x = 1; x <= 2 * kReach + 1; x++) {
          square[-x] = square[mirrored (-x, width)];
          square[width - 1 + x] = square[mirrored (width - 1 + x, width)];
        }
      kernels.sum_blocks (to[i] - 2 * kReach, to[i + kChunk] - 2 * kReach,
          band.blocks + 2 * kReach, band.sums[i].row (y) - kReach);
    }
  }
}

/* The squared error of the classes of @set around each block of the band. */
void
MotionFilter::measure (const Kernels &kernels, const PairFrames &frames,
    const Set &set, std::size_t first, Band &band) const
{
  const Blur blur;
  for (const FilterBank &residuals : set.residuals) {
    measure_blocks (kernels, frames, residuals, band);
    for (int i = 0; i < residuals.outputs (); i++, first++) {
      const Field &sums = band.sums[std::size_t (i)];
      for (int y = -kReach; y < band.rows + kReach; y++)
        blur.run (
            kernels, sums.row (y), 1, band.blocks, band.along.row (y + kReach));
      for (int y = 0; y < band.rows; y++)
        blur.run (kernels, band.along.row (y + kReach), band.along.stride (),
            band.blocks, band.fit (first, y));
    }
  }
}

/* Weights (best error / error) ^ 8. Were the errors independent, the number of
 * those in the surroundings would ask for a power of some 20; but they are not,
 * and a mean of several filters is truer than the one that happens to fit best.
 */
void
MotionFilter::set_weights (
    const Kernels &kernels, Band &band, Field *misfit) const
{
  Field least (band.blocks, 1);
  std::vector<float *> fit (band.factors.size ());
  for (int y = 0; y < band.rows; y++) {
    for (std::size_t c = 0; c < fit.size (); c++)
      fit[c] = band.fit (c, y);
    kernels.weigh ({fit.data (), band.factors.data (), int (fit.size ()),
                       kErrorFloor, kMinWeight, band.blocks},
        least.row (0));
    for (int row = 2 * (band.first + y);
         misfit && row < misfit->height () && row < 2 * (band.first + y + 1);
         row++)
      for (int x = 0; x < misfit->width (); x++)
        misfit->row (row)[x] = least.row (0)[x / 2];
  }
}

/* Adds the slots of the classes of @set, the first of which is @first. */
void
MotionFilter::mix (const Kernels &kernels, const PairFrames &frames,
    const Set &set, std::size_t first, Band &band, std::span<Field> slots) const
{
  std::vector<const std::int32_t *> sources;
  std::vector<float *> to (slots.size ());
  const int end = std::min (2 * (band.first + band.rows), frames[1]->height ());
  for (const FilterBank &filter : set.filters) {
    for (int y = 2 * band.first; y < end; y++) {
      for (std::size_t s = 0; s < slots.size (); s++)
        to[s] = slots[s].row (y);
      kernels.filter_pairs_add (filter.row (phases_, frames, y, sources),
          band.fit (first, y / 2 - band.first), to.data ());
    }
    first++;
  }
}

bool
MotionFilter::run (const Kernels &kernels, const PairFrames &frames,
    std::span<Field> slots, Field *misfit, Workers &workers,
    std::stop_token stop)
{
  const int width = frames[1]->width (), height = frames[1]->height ();
  const std::vector<const Set *> sets = sets_for (frames);
  std::vector<float> factors;
  for (const Set *set : sets)
    std::ranges::copy (set->factors, std::back_inserter (factors));
  std::vector<std::optional<Band>> bands (std::size_t (workers.count ()));
  const int rows = (height + 1) / 2;
  return workers.run ((rows + kBandRows - 1) / kBandRows,
      [&] (int part, int worker) {
        auto &band = bands[std::size_t (worker)];
        if (!band)
          band.emplace (width, factors);
        band->first = part * kBandRows;
        band->rows = std::min (kBandRows, rows - band->first);
        const auto each_set = [&] (const auto &use) {
          std::size_t first = 0;
          for (const Set *set : sets) {
            use (*set, first);
            first += set->filters.size ();
          }
        };
        each_set ([&] (const Set &set, std::size_t c) {
          measure (kernels, frames, set, c, *band);
        });
        set_weights (kernels, *band, misfit);
        const int end = std::min (2 * (band->first + band->rows), height);
        for (Field &slot : slots)
          for (int y = 2 * band->first; y < end; y++)
            std::fill_n (slot.row (y), width, 0.0f);
        each_set ([&] (const Set &set, std::size_t c) {
          mix (kernels, frames, set, c, *band, slots);
        });
      },
      stop);
}

} // namespace codedexposure::fuse

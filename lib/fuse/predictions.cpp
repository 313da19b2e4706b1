/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/predictions.h"

#include <algorithm>
#include <cmath>

namespace codedexposure::fuse
{

namespace
{

/* All slots are the same; or they are less correlated than in any real scene.
 */
constexpr SceneClass kStatic{0.0, 0.0, 5.0, 1.5, 1.0};
constexpr SceneClass kMoving{0.0, 0.0, 5.0, 1.5, 0.6};

/* Of the taps in the coded frames before and after, px. */
constexpr double kComparedRadius = 1.2;
/* Squared errors of filters beyond those with all taps, as a part of them. */
constexpr double kExcess = 0.01, kExcessWithPartner = 0.06;
/* Mean squared errors of this size, in grey levels squared, do not tell models
 * apart. */
constexpr float kErrorFloor = 0.5f;
/* No model has less weight, so that there is always one. */
constexpr float kMinWeight = 1e-6f;
/* Rows of blocks that a thread takes at a time, at least. */
constexpr int kMinRows = 8;
/* Ratio of the prediction errors if static and if moving, up to which nothing
 * repeats, and from which on it does. */
constexpr Fade kRepetition{1.3f, 1.8f};

Extent
blocks_of (Extent size)
{
  return {std::max (size.width / 2, 1), std::max (size.height / 2, 1)};
}

} // namespace

Predictions::Predictions (
    const FilterPlan &plan, const Models &models, Extent size, int around)
    : plan_ (plan), models_ (models), reach_ ((around + 1) / 2)
{
  const int period = plan.sources.period ();
  const Extent blocks = blocks_of (size);
  const int classes = 1 + std::max (models.most (), 1);
  rooms_.push_back ({Field (blocks.width, classes, reach_),
      Field (SplitField::split_length (size.width, period), period / 2),
      std::vector (std::size_t (classes),
          BoxFilter (blocks.width, blocks.height, reach_)),
      {}});
  const Field of_blocks (blocks.width, blocks.height);
  found_ = {of_blocks, {}, of_blocks};
  if (models.most () > 1)
    found_.preferences.assign (std::size_t (models.most ()), of_blocks);
  for (const bool before : {false, true}) {
    const Neighbours usual = models_.used (plan.usual (before));
    filters_.get (usual, [&] { return make_filters (usual); });
  }
}

FilterBank
Predictions::make_filters (Neighbours neighbours) const
{
  std::vector<SceneClass> classes = models_.with (neighbours);
  if (classes.size () < 2)
    classes = {kMoving};
  classes.insert (classes.begin (), kStatic);
  const double radius = plan_.radius - 1.5;
  const std::vector<Tap> near = taps_around (
                             radius, kComparedRadius, neighbours.none ()),
                         all =
                             taps_around (radius, kComparedRadius, neighbours);
  /* Their taps fit some motion by chance, the more of all taps they are: their
   * squared errors count as this much larger. */
  const float chance =
      std::sqrt (1.0f + 1.0f / float (plan_.observation.slots ()));
  FilterBank bank (plan_, int (classes.size ()));
  for (std::size_t k = 0; k < classes.size (); k++) {
    /* Neither a static scene nor fast motion needs other frames. */
    const bool alone = k == 0 || k + 1 == classes.size () || !neighbours.any ();
    const std::vector<Tap> &taps = alone ? near : all;
    for_each_sparse_phase (plan_, classes[k], taps, Sought::kResidual,
        neighbours.partner ? kExcessWithPartner : kExcess,
        [&] (int row, int x, std::vector<float> weights) {
          if (!alone)
            for (float &weight : weights)
              weight *= chance;
          bank.set (row, x, int (k), taps, weights);
        });
  }
  return bank;
}

/* Errors of the blocks of row @row: the parts of the columns of a block are
 * added to each other. */
void
Predictions::predict (const FilterBank &filters, const CodedFrames &frames,
    int row, Room &room) const
{
  const int *phases[2];
  for (int i = 0; i < 2; i++) {
    plan_.sources.row (frames, 2 * row + i, room.of_rows[i]);
    phases[i] = plan_.phases.of_row (2 * row + i);
  }
  const int period = plan_.sources.period ();
  const Run whole{0, room.parts.width ()};
  for (int k = 0; k < filters.groups (); k++) {
    for (int column = 0; column < period; column++) {
      float *to = room.parts.row (column / 2);
      if (column % 2 == 0)
        std::fill_n (to, room.parts.width (), 0.0f);
      for (int i = 0; i < 2; i++)
        plan_.kernels.filter_squared (filters.row (phases[i][column], column, k,
                                          room.of_rows[i], {&whole, 1}),
            &to);
    }
    plan_.kernels.join ({period / 2, room.parts.stride (), room.rows.width ()},
        room.parts.row (0), nullptr, room.rows.row (k));
  }
}

/* Models are compared by the sums of their squared errors. Their power of 8
 * stands for the number of independent errors in a square.
 * @errors: of a static scene, then of each model, for row @row of blocks. */
void
Predictions::compare (int row, std::span<const float *const> errors)
{
  auto &[unrepeated, preferences, misfit] = found_;
  const float area = float (4 * (2 * reach_ + 1) * (2 * reach_ + 1));
  const int width = misfit.width ();
  const int models = int (errors.size ()) - 1;
  const auto repeat_last = [width] (float *values) {
    values[width] = values[width - 1];
  };
  plan_.kernels.fade_ratio (errors.front (), errors.back (), kErrorFloor * area,
      kRepetition, width, unrepeated.row (row));
  repeat_last (unrepeated.row (row));
  float *least = misfit.row (row);
  std::copy_n (errors[1], width, least);
  for (const float *errors_of_model : errors.subspan (2))
    for (int x = 0; x < width; x++)
      least[x] = std::min (least[x], errors_of_model[x]);
  for (int x = 0; x < width; x++)
    least[x] = least[x] / area + kErrorFloor;
  if (preferences.empty ())
    return;
  std::vector<float *> to;
  for (Field &preference : preferences)
    to.push_back (preference.row (row));
  plan_.kernels.prefer (
      {errors.data () + 1, models, kErrorFloor * area, kMinWeight, width},
      to.data ());
  std::ranges::for_each (to, repeat_last);
}

/* @band: of blocks. */
void
Predictions::predict_rows (
    const FilterBank &filters, const CodedFrames &frames, const Band &band)
{
  Room &room = rooms_[std::size_t (band.worker)];
  const int rows = found_.misfit.height ();
  std::vector<const float *> sums (std::size_t (filters.groups ()));
  for (int row = std::max (band.first - reach_, 0); row < band.end + reach_;
       row++) {
    if (row < rows) {
      predict (filters, frames, row, room);
      for (std::size_t k = 0; k < sums.size (); k++) {
        room.sums[k].extend (room.rows.row (int (k)));
        room.sums[k].add_row (plan_.kernels.sum, row, room.rows.row (int (k)));
      }
    }
    if (row - reach_ < band.first)
      continue;
    for (std::size_t k = 0; k < sums.size (); k++)
      sums[k] = room.sums[k].result (plan_.kernels.sum, row - reach_);
    compare (row - reach_, sums);
  }
}

const Predictions::Found &
Predictions::run (const CodedFrames &frames, const Task &task)
{
  const Neighbours used = models_.used (frames.neighbours ());
  const FilterBank &filters =
      filters_.get (used, [&] { return make_filters (used); });
  rooms_.resize (std::size_t (task.workers.count ()), rooms_.front ());
  run_bands (task, found_.misfit.height (), kMinRows,
      [&] (const Band &band) { predict_rows (filters, frames, band); });
  return found_;
}

} // namespace codedexposure::fuse

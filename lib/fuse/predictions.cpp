/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/predictions.h"

#include "estimate/kriging.h"

namespace codedexposure::fuse
{

Predictions::Predictions (const Phases &phases, const Observation &observation,
    std::span<const SceneClass> classes, int taps, int around, Extent size,
    std::span<const double> noise, float steps)
    : phases_ (phases),
      filters_ (phases, disc (taps + 0.5), int (classes.size ()), steps),
      rooms_ (1, {Field (size.width, int (classes.size ()), around),
                     std::vector (classes.size (),
                         BoxFilter (size.width, size.height, around))})
{
  for (std::size_t k = 0; k < classes.size (); k++)
    for_each_phase (phases, observation, classes[k], disc (taps + 0.5), noise,
        [&] (int row, int x, const PhaseWeights &weights) {
          filters_.set (row, x, int (k), weights.residual);
        });
}

void
Predictions::make_room (int count)
{
  rooms_.resize (std::size_t (count), rooms_.front ());
}

void
Predictions::run (const Kernels &kernels, const PairField &coded, int first,
    int end, int worker, const Use &use)
{
  auto &[rows, filters] = rooms_[std::size_t (worker)];
  const int height = coded.height ();
  const int around = filters[0].radius ();
  const auto offsets = filters_.offsets (coded);
  std::vector<float *> errors;
  for (std::size_t k = 0; k < filters.size (); k++)
    errors.push_back (rows.row (int (k)));
  std::vector<const float *> sums (filters.size ());
  for (int y = std::max (first - around, 0); y < end + around; y++) {
    if (y < height) {
      kernels.filter_pairs_squared (
          filters_.row (phases_, coded, y, offsets), errors.data ());
      for (std::size_t k = 0; k < filters.size (); k++) {
        filters[k].extend (errors[k]);
        filters[k].add_row (kernels.sum, y, errors[k]);
      }
    }
    if (y - around >= first) {
      for (std::size_t k = 0; k < filters.size (); k++)
        sums[k] = filters[k].result (kernels.sum, y - around);
      use (y - around, sums.data ());
    }
  }
}

} // namespace codedexposure::fuse

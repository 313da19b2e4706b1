/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/predictions.h"

#include "estimate/kriging.h"

namespace codedexposure::fuse
{

Predictions::Predictions (const Phases &phases, const Observation &observation,
    std::span<const SceneClass> classes, int taps, int around, Extent size,
    std::span<const double> noise)
    : phases_ (phases),
      filters_ (phases, disc (taps + 0.5), int (classes.size ())),
      rows_ (size.width, int (classes.size ()), around),
      sums_ (classes.size (), BoxFilter (size.width, size.height, around))
{
  for (std::size_t k = 0; k < classes.size (); k++)
    for_each_phase (phases, observation, classes[k], disc (taps + 0.5), noise,
        [&] (int row, int x, const PhaseWeights &weights) {
          filters_.set (row, x, int (k), weights.residual);
        });
}

void
Predictions::run (const Kernels &kernels, const Field &coded, const Use &use)
{
  const int width = coded.width (), height = coded.height ();
  const int around = sums_[0].radius ();
  const auto offsets = filters_.offsets (coded);
  std::vector<float *> errors;
  for (std::size_t k = 0; k < sums_.size (); k++)
    errors.push_back (rows_.row (int (k)));
  std::vector<const float *> sums (sums_.size ());
  for (int y = 0; y < height + around; y++) {
    if (y < height) {
      kernels.filter (
          filters_.row (phases_, coded, y, offsets), errors.data ());
      for (std::size_t k = 0; k < sums_.size (); k++) {
        for (int x = 0; x < width; x++)
          errors[k][x] *= errors[k][x];
        sums_[k].extend (errors[k]);
        sums_[k].add_row (kernels.sum, y, errors[k]);
      }
    }
    if (y >= around) {
      for (std::size_t k = 0; k < sums_.size (); k++)
        sums[k] = sums_[k].result (kernels.sum, y - around);
      use (y - around, sums.data ());
    }
  }
}

} // namespace codedexposure::fuse

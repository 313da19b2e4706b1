/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/predictions.h"

#include "fuse/kriging.h"

namespace cexp::fuse
{

Predictions::Predictions (const Phases &phases, const Observation &observation,
    std::span<const SceneClass> classes, int taps, int around, Extent size,
    std::span<const double> noise)
    : phases_ (phases), filters_ (phases, disc (taps), int (classes.size ())),
      rows_ (size.width, int (classes.size ()), around),
      sums_ (classes.size (), Around (size.width, size.height, around))
{
  const std::vector<Offset> places = disc (taps);
  for (std::size_t k = 0; k < classes.size (); k++) {
    const Covariance covariance (classes[k], observation, 2 * taps);
    for (int row = 0; row < phases.rows (); row++)
      for (int x = 0; x < phases.period (); x++)
        filters_.set (row, x, int (k),
            solve_phase (covariance, observation, phases, row, x, places, noise)
                .residual);
  }
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
        sums_[k].take (kernels.sum, y, errors[k]);
      }
    }
    if (y >= around) {
      for (std::size_t k = 0; k < sums_.size (); k++)
        sums[k] = sums_[k].square (kernels.sum, y - around);
      use (y - around, sums.data ());
    }
  }
}

} // namespace cexp::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/predictions.h"

#include "estimate/kriging.h"

namespace codedexposure::fuse
{

Predictions::Predictions (int classes, int around, Extent size)
    : rooms_ (1, {Field (size.width, classes, around),
                     std::vector (std::size_t (classes),
                         BoxFilter (size.width, size.height, around))})
{
}

void
Predictions::make_room (int count)
{
  rooms_.resize (std::size_t (count), rooms_.front ());
}

void
Predictions::run (const Kernels &kernels, const Phases &phases,
    const FilterBank &filters, const PairFrames &frames, int first, int end,
    int worker, const Use &use)
{
  auto &[rows, boxes] = rooms_[std::size_t (worker)];
  const int height = frames[1]->height ();
  const int around = boxes[0].radius ();
  std::vector<const std::int32_t *> sources;
  std::vector<float *> errors;
  const auto classes = std::size_t (filters.outputs ());
  for (std::size_t k = 0; k < classes; k++)
    errors.push_back (rows.row (int (k)));
  std::vector<const float *> sums (classes);
  for (int y = std::max (first - around, 0); y < end + around; y++) {
    if (y < height) {
      kernels.filter_pairs_squared (
          filters.row (phases, frames, y, sources), errors.data ());
      for (std::size_t k = 0; k < classes; k++) {
        boxes[k].extend (errors[k]);
        boxes[k].add_row (kernels.sum, y, errors[k]);
      }
    }
    if (y - around >= first) {
      for (std::size_t k = 0; k < classes; k++)
        sums[k] = boxes[k].result (kernels.sum, y - around);
      use (y - around, sums.data ());
    }
  }
}

} // namespace codedexposure::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/predictions.h"

#include <algorithm>
#include <array>

#include "estimate/kriging.h"

namespace codedexposure::fuse
{

Predictions::Predictions (int classes, int around, Extent size, int period)
    : reach_ ((around + 1) / 2),
      rooms_ (1,
          {Field (blocks (size).width, classes, reach_),
              Field (SplitField::split_length (size.width, period), period / 2),
              std::vector (
                  std::size_t (classes), BoxFilter (blocks (size).width,
                                             blocks (size).height, reach_))})
{
}

void
Predictions::make_room (int count)
{
  rooms_.resize (std::size_t (count), rooms_.front ());
}

/* Errors of the blocks of row @row: the parts of the columns of a block are
 * added to each other. */
void
Predictions::predict (const Kernels &kernels, const Phases &phases,
    const SparseSources &sources, const SparseBank &filters,
    const SplitFrames &frames, int row, Room &room) const
{
  std::array<std::vector<const std::int32_t *>, 2> of_rows;
  for (int i = 0; i < 2; i++)
    sources.row (frames, 2 * row + i, of_rows[std::size_t (i)]);
  const int period = frames[1]->period ();
  const Run whole{0, room.parts.width ()};
  for (int k = 0; k < filters.outputs (); k++) {
    for (int column = 0; column < period; column++) {
      float *to = room.parts.row (column / 2);
      if (column % 2 == 0)
        std::fill_n (to, room.parts.width (), 0.0f);
      for (int i = 0; i < 2; i++)
        kernels.filter_sparse_squared (
            filters.row (phases, 2 * row + i, column, k,
                of_rows[std::size_t (i)], {&whole, 1}),
            to);
    }
    kernels.join ({period / 2, room.parts.stride (), room.rows.width ()},
        room.parts.row (0), nullptr, room.rows.row (k));
  }
}

void
Predictions::run (const Kernels &kernels, const Phases &phases,
    const SparseSources &sources, const SparseBank &filters,
    const SplitFrames &frames, int first, int end, int worker, const Use &use)
{
  Room &room = rooms_[std::size_t (worker)];
  auto &boxes = room.sums;
  const int rows = blocks ({frames[1]->width (), frames[1]->height ()}).height;
  const auto classes = std::size_t (filters.outputs ());
  std::vector<const float *> sums (classes);
  for (int row = std::max (first - reach_, 0); row < end + reach_; row++) {
    if (row < rows) {
      predict (kernels, phases, sources, filters, frames, row, room);
      for (std::size_t k = 0; k < classes; k++) {
        boxes[k].extend (room.rows.row (int (k)));
        boxes[k].add_row (kernels.sum, row, room.rows.row (int (k)));
      }
    }
    if (row - reach_ >= first) {
      for (std::size_t k = 0; k < classes; k++)
        sums[k] = boxes[k].result (kernels.sum, row - reach_);
      use (row - reach_, sums.data ());
    }
  }
}

} // namespace codedexposure::fuse

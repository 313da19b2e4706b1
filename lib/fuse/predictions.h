/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How well its neighbours predict each pixel, under several models of scenes.
 */
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "fuse/box_filter.h"
#include "fuse/field.h"
#include "fuse/sparse_bank.h"

namespace codedexposure::fuse
{

/**
 * A coded pixel is predicted from its neighbours, which saw other slots, under
 * each class of scenes in turn. The true class predicts best, in spite of
 * aliasing.
 */
class Predictions
{
public:
  /** @p around  radius of the squares over which errors are summed, px.
   *  @p period  of the parts of rows, even. */
  Predictions (int classes, int around, Extent size, int period);

  /** Blocks of 2x2 pixels; an odd last row or column belongs to the one before
   * it. */
  static Extent blocks (Extent size)
  {
    return {std::max (size.width / 2, 1), std::max (size.height / 2, 1)};
  }
  /** Pixels of a square over which errors are summed. */
  int area () const { return 4 * (2 * reach_ + 1) * (2 * reach_ + 1); }

  /** Room for threads of number 0 .. @p count - 1. */
  void make_room (int count);
  /** Calls @p use with the sums of squared errors around the blocks of rows
   * @p first .. @p end - 1 of blocks, of each class, an output of @p filters.
   */
  using Use = std::function<void (int row, const float *const *errors)>;
  void run (const Kernels &kernels, const Phases &phases,
      const SparseSources &sources, const SparseBank &filters,
      const SplitFrames &frames, int first, int end, int worker,
      const Use &use);

private:
  /** Of a thread. */
  struct Room {
    Field rows;  ///< of squared errors of blocks, one of each class
    Field parts; ///< of one of them
    std::vector<BoxFilter> sums;
  };

  void predict (const Kernels &kernels, const Phases &phases,
      const SparseSources &sources, const SparseBank &filters,
      const SplitFrames &frames, int row, Room &room) const;

  int reach_; ///< blocks around a block over which errors are summed
  std::vector<Room> rooms_; ///< one at least
};

} // namespace codedexposure::fuse

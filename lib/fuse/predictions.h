/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How well its neighbours predict each pixel, under several models of scenes.
 */
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "fuse/box_filter.h"
#include "fuse/field.h"
#include "fuse/filter_bank.h"

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
  /** @p around  radius of the squares over which errors are summed, px. */
  Predictions (int classes, int around, Extent size);

  /** Room for threads of number 0 .. @p count - 1. */
  void make_room (int count);
  /** Calls @p use with the sums of squared errors around the pixels of rows
   * @p first .. @p end - 1, of each class, an output of @p filters. */
  using Use = std::function<void (int y, const float *const *errors)>;
  void run (const Kernels &kernels, const Phases &phases,
      const FilterBank &filters, const PairFrames &frames, int first, int end,
      int worker, const Use &use);

private:
  /** Of a thread. */
  struct Room {
    Field rows; ///< of squared errors, one of each class
    std::vector<BoxFilter> sums;
  };

  std::vector<Room> rooms_; ///< one at least
};

} // namespace codedexposure::fuse

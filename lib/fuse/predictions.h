/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How well its neighbours predict each pixel, under several models of scenes.
 */
#pragma once

#include <vector>

#include "fuse/bands.h"
#include "fuse/box_filter.h"
#include "fuse/filter_bank.h"
#include "fuse/models.h"

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
  /** @p plan    outlives this.
   *  @p models  that are compared with each other and with a static scene; if
   *             there are not several, scenes that move are.
   *  @p around  radius of the squares over which errors are summed, px. */
  Predictions (
      const FilterPlan &plan, const Models &models, Extent size, int around);

  /** Of blocks of 2x2 pixels; an odd last row or column belongs to the one
   * before it. */
  struct Found {
    /** 1; less where a scene that repeats with the frame rate is detected, and
     * 0 where every slot shows a different picture for sure. */
    Field unrepeated;
    /** For each of several models, see Kernels::prefer. */
    std::vector<Field> preferences;
    /** Mean squared error of the best model, grey levels squared. */
    Field misfit;
  };
  /** Valid until it runs again. */
  const Found &run (const CodedFrames &frames, const Task &task);

private:
  /** Of a thread. */
  struct Room {
    Field rows;  ///< of squared errors of blocks, one of each class
    Field parts; ///< of one of them
    std::vector<BoxFilter> sums;
    std::vector<const std::int32_t *> of_rows[2];
  };

  FilterBank make_filters (Neighbours neighbours) const;
  void predict (const FilterBank &filters, const CodedFrames &frames, int row,
      Room &room) const;
  void predict_rows (
      const FilterBank &filters, const CodedFrames &frames, const Band &band);
  void compare (int row, std::span<const float *const> errors);

  const FilterPlan &plan_;
  Models models_;
  int reach_; ///< blocks around a block over which errors are summed
  ForNeighbours<FilterBank> filters_;
  std::vector<Room> rooms_; ///< one at least
  Found found_;
};

} // namespace codedexposure::fuse

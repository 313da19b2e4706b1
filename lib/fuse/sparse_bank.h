/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Filters with few taps, others for every phase and output. */
#pragma once

#include <array>
#include <span>
#include <vector>

#include "fuse/field.h"
#include "fuse/kernels.h"
#include "fuse/phases.h"

namespace codedexposure::fuse
{

/** The coded frames before, at and after the one that is fused; null if there
 * is none. */
using SplitFrames = std::array<const SplitField *, 3>;

/** Where the taps of the filters of a row are. */
class SparseSources
{
public:
  /** @p reach  of the taps in the frame that is fused, and in its neighbours.
   *  @p frame  like those that are filtered. */
  SparseSources (std::array<int, 3> reach, const SplitField &frame);

  /** Number of the source that has the pixel at @p tap. */
  int number (const Tap &tap) const;
  /** Of column 0 of row @p y; those of column c are c further. */
  std::span<const std::int32_t *const> row (const SplitFrames &frames, int y,
      std::vector<const std::int32_t *> &sources) const;

private:
  std::array<int, 3> reach_; ///< negative: frames without taps
  std::array<int, 3> first_; ///< source of each frame
  int rows_ = 0;
  int margin_;
  std::vector<std::ptrdiff_t> places_; ///< of a row, from the margin on
};

/** Like a FilterBank, but each filter has only the taps that it needs. */
class SparseBank
{
public:
  /** @p steps  of a pixel per grey level. */
  SparseBank (const Phases &phases, int outputs, float steps);

  int outputs () const { return outputs_; }
  /** Once for each output of the pixels at @p x of distinct row @p row. */
  void set (const SparseSources &sources, int row, int x, int output,
      std::span<const Tap> taps, std::span<const float> weights);
  /** The kernels' input for output @p output of the pixels at @p column and
   * every period after it, of row @p y. */
  SparseRow row (const Phases &phases, int y, int column, int output,
      std::span<const std::int32_t *const> sources,
      std::span<const Run> runs) const;

private:
  struct Filter {
    std::vector<SparsePair> pairs;
    float scale = 0.0f;
  };

  int outputs_;
  int period_;
  float steps_;
  float base_ = 0.0f; ///< the sum of weights times the light below black
  std::vector<Filter> filters_; ///< of each row, phase and output
};

} // namespace codedexposure::fuse

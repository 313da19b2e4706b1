/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Filters of every phase, in the layout of the kernels. */
#pragma once

#include <span>
#include <vector>

#include "fuse/field.h"
#include "fuse/kernels.h"
#include "fuse/phases.h"

namespace codedexposure::fuse
{

/** For every pixel of a frame, @p outputs weighted sums over the same taps.
 * Pixels and weights are rounded to 16 bits: pixels to kSmallest for black and
 * a number of steps per grey level, weights such that their sum stays. The sums
 * of all weights of a bank are equal. */
class FilterBank
{
public:
  static constexpr int kSmallest = -32768, kLargest = 32767;

  /** @p steps  of a pixel per grey level. */
  FilterBank (
      const Phases &phases, std::vector<Offset> taps, int outputs, float steps);

  /** Weights of the pixels at @p x of distinct row @p row of the phases. */
  void set (int row, int x, int output, std::span<const float> weights);
  /** Of all outputs, one after the other. */
  void set_all (int row, int x, std::span<const float> weights);
  /** The kernels' input for row @p y of @p source, whose margin is as large as
   * the taps' radius; @p offsets from offsets () of a field of its size. */
  PairRow row (const Phases &phases, const PairField &source, int y,
      std::span<const std::ptrdiff_t> offsets) const;
  /** Offsets of the pairs in @p field. */
  std::vector<std::ptrdiff_t> offsets (const PairField &field) const;

private:
  struct Place {
    std::size_t pair;
    bool upper;
  };

  std::vector<Offset> pairs_; ///< of their first tap
  std::vector<Place> places_; ///< of each tap
  int outputs_;
  int period_;
  int width_;
  float steps_;
  float base_ = 0.0f; ///< the sum of weights times the light below black
  std::vector<std::int32_t> weights_;
  std::vector<float> scales_; ///< of each row and output, as the weights
};

} // namespace codedexposure::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Filters of every phase, in the layout of the kernels. */
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
using PairFrames = std::array<const PairField *, 3>;

/** Weights times @p unit, a power of two. */
struct WholeWeights {
  std::vector<int> values;
  float unit;
};

/** Rounded to 16 bits such that the sum stays. */
WholeWeights round_weights (std::span<const float> weights);

/** For every pixel of a frame, @p outputs weighted sums over the same taps.
 * Pixels and weights are rounded to 16 bits: pixels to kSmallest for black and
 * a number of steps per grey level, weights such that their sum stays. The sums
 * of all weights of a bank are equal. */
class FilterBank
{
public:
  static constexpr int kSmallest = -32768, kLargest = 32767;

  /** @p steps  of a pixel per grey level. */
  FilterBank (const Phases &phases, std::span<const Tap> taps, int outputs,
      float steps);

  int outputs () const { return outputs_; }
  /** Weights of the pixels at @p x of distinct row @p row of the phases. */
  void set (int row, int x, int output, std::span<const float> weights);
  /** Of all outputs, one after the other. */
  void set_all (int row, int x, std::span<const float> weights);
  /** The kernels' input for row @p y of @p frames, whose margin is as large as
   * the taps' radius. Valid until @p sources changes. */
  PairRow row (const Phases &phases, const PairFrames &frames, int y,
      std::vector<const std::int32_t *> &sources) const;

private:
  struct Place {
    std::size_t pair;
    bool upper;
  };

  std::vector<Tap> pairs_;    ///< of their first tap
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

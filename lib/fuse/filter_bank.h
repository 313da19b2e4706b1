/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Filters of every phase, in the layout of the kernels. */
#pragma once

#include <array>
#include <span>
#include <vector>

#include "fuse/coded_stream.h"
#include "fuse/kernels.h"
#include "fuse/phases.h"

namespace codedexposure::fuse
{

/** Adds block @p block of a row to the runs before it. */
inline void
add_block (std::vector<Run> &runs, int block)
{
  const int first = block * kRunBlock;
  if (!runs.empty () && runs.back ().first + runs.back ().count == first)
    runs.back ().count += kRunBlock;
  else
    runs.push_back ({first, kRunBlock});
}

/** Where the taps of the filters of a row are: the pixels within a distance of
 * it in the frame that is fused, those within another distance in the coded
 * frames before and after it, and those within kPartnerRadius in its partner.
 */
class TapSources
{
public:
  /** @p frame      like those that are filtered, with a margin as large as the
   *                taps' radius.
   *  @p neighbour  radius of taps in the coded frames before and after. */
  TapSources (const SplitField &frame, int neighbour);

  int period () const { return period_; } ///< of the parts of rows
  int width () const { return width_; }   ///< of frames
  /** Number of the source that has the pixel at @p tap. */
  int number (const Tap &tap) const;
  /** Of column 0 of row @p y; those of column c are c further. Sources in
   * frames that there are not are null. */
  std::span<const std::int32_t *const> row (const CodedFrames &frames, int y,
      std::vector<const std::int32_t *> &sources) const;

private:
  std::array<int, 4> reach_;           ///< of taps in each frame
  std::array<int, 4> first_;           ///< source of each frame
  std::vector<std::ptrdiff_t> places_; ///< of a row, from the margin on
  int rows_ = 0;
  int margin_, period_, width_;
};

/**
 * For every pixel of a frame, weighted sums over its taps. Outputs are in
 * groups that share taps. Pixels and weights are rounded to 16 bits: pixels to
 * kSmallest for black and plan.steps per grey level, weights such that their
 * sum stays. The sums of all weights of a bank are equal.
 */
class FilterBank
{
public:
  static constexpr int kSmallest = -32768, kLargest = 32767;

  FilterBank (const FilterPlan &plan, int groups);

  int groups () const { return groups_; }
  /** Once for each group, for the pixels at @p x of distinct row @p row. The
   * weight of tap t for output k of the group is at [k * taps + t]. */
  void set (int row, int x, int group, std::span<const Tap> taps,
      std::span<const float> weights);
  /** The kernels' input for a group of the pixels at @p column and every period
   * after it, of a row where they have @p phase. */
  FilterRow row (int phase, int column, int group,
      std::span<const std::int32_t *const> sources,
      std::span<const Run> runs) const;

private:
  struct Filter {
    std::vector<std::int32_t> pairs; ///< see FilterRow
    int count = 0;                   ///< of them
    std::vector<float> scales;       ///< of each output
  };
  std::size_t place (int phase, int group) const
  {
    return std::size_t (phase * groups_ + group);
  }

  const FilterPlan *plan_;
  int groups_;
  float base_ = 0.0f; ///< the sum of weights times the light below black
  std::vector<Filter> filters_;
};

} // namespace codedexposure::fuse

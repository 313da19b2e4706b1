/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Fusion of light: the part of a Fuser that does not depend on the pixel type.
 */
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "estimate/observation.h"
#include "fuse/collaborative_filter.h"
#include "fuse/field.h"
#include "fuse/filter_sets.h"
#include "fuse/fuser.h"
#include "fuse/motion.h"
#include "fuse/predictions.h"
#include "fuse/refine.h"
#include "fuse/static_pixels.h"
#include "fuse/uncertainty.h"

namespace codedexposure::fuse
{

/** Row @p y of every slot, of the frame's width, 255 for white. Threads may
 * call it for different rows at the same time. */
using RowSink = std::function<void (int y, const float *const *slots)>;

/** Light in the coded frame to light in every slot; see Fuser. */
class Engine
{
public:
  static Result<std::unique_ptr<Engine>> make (const Schedule &schedule,
      int width, int height, const FuseOptions &options, double steps);

  int slots () const { return observation_.slots (); }
  int width () const { return width_; }
  int height () const { return height_; }
  const Kernels &kernels () const { return kernels_; }

  /** Why options.refine has no effect here; empty if it has or is not set. */
  const std::string &unrefined () const { return unrefined_; }

  /** A field to write the next coded frame to, times gain () row by row. */
  Field &next ();
  /** Factors of the pixels of row @p y, beside 255 / white; null where they are
   * all 1. */
  const float *gain (int y) const;
  /** Queues the frame in next (). */
  void take ();

  int pending () const { return int (queue_.size ()); }
  /** @p deviations  gets the half-width of the 68 % interval of each pixel, if
   *                 it is set.
   * False when it was stopped; the frame is dropped then. */
  bool fuse (const RowSink &sink, Workers &workers, std::stop_token stop,
      const Uncertainty::Sink &deviations = {});
  void forget ();
  /** What the deviations of the last frame were computed from, row by row, and
   * the weight of static pixels, for tests/quality/uncertainty. Only after a
   * fuse () that gave deviations. */
  using UseUncertain = std::function<void (int slot, int y,
      const Uncertainty::Pixel *pixels, const float *is_static)>;
  void each_uncertain_row (const UseUncertain &use, Workers &workers) const;

private:
  Engine (const Schedule &schedule, int width, int height,
      const FuseOptions &options, double steps);
  void map_noise (const Schedule &schedule);
  void find_margin (const Schedule &schedule);
  void prepare (const Schedule &schedule, const FuseOptions &options);
  int split_period () const;
  /** A coded frame; the pairs have a margin. */
  struct Coded {
    Field light;
    PairField pairs;
    SplitField split; ///< the pairs
  };
  void pair_pixels (Coded &coded) const;
  int part_rows (const Workers &workers) const;
  void each_part (Workers &workers,
      const std::function<void (StaticPixels::Rows)> &use) const;
  /** Sets what static pixels and the preferences need to know of predictions.
   */
  void compare_predictions (const FilterSets::Set &filters,
      const SplitFrames &frames, StaticPixels::Rows rows);
  void set_misfit (int row, const float *const *errors, int models);
  struct Estimates;
  void share (const Field &coded, int y, Estimates &to) const;
  void estimate (const FilterSets::Set &filters, const SplitFrames &frames,
      int y, Estimates &to) const;
  void fuse_linear (const FilterSets::Set &filters, const Field &coded,
      const SplitFrames &frames, const RowSink &sink,
      StaticPixels::Rows part) const;
  void blend (const float *light, int y, float *const *rows) const;
  void smooth_static_light (const StaticPixels::Frames &frames);
  bool fuse_motion (const StaticPixels::Frames &frames, const PairFrames &pairs,
      const RowSink &sink, Workers &workers, std::stop_token stop);
  /** Standard deviation of coded pixels in grey levels. */
  double typical_noise () const;

  int width_, height_;
  Observation observation_;
  Phases phases_;
  const Kernels &kernels_;
  int radius_;
  float steps_; ///< of 16 bits, per grey level
  std::function<void ()> make_uncertainty_;
  std::optional<Predictions> predictions_;
  std::optional<FilterSets> filters_;
  std::vector<Field> preferences_; ///< of blocks, for each of several models
  std::optional<MotionFilter> motion_;
  std::optional<CollaborativeFilter> collaborative_;
  std::vector<Field> light_;               ///< of each slot, unless fast
  Field static_light_;                     ///< unless fast, or without noise
  std::optional<Uncertainty> uncertainty_; ///< made when it is first wanted
  Field *misfit_ = nullptr;                ///< of the frame; null: not wanted
  std::optional<Refiner> refiner_;
  std::string unrefined_;
  NoiseMap noise_;
  Field gain_; ///< empty if it is 1 everywhere
  StaticPixels static_pixels_;

  /* Pixels of the margin and the pixels that they repeat. */
  struct Repeat {
    std::ptrdiff_t to, from;
  };
  std::vector<Repeat> margin_;

  std::deque<Coded> queue_;
  Coded previous_; ///< empty if there is none
  Coded spare_;
};

} // namespace codedexposure::fuse

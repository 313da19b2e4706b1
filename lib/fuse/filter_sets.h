/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The filters of models of scenes, with and without neighbouring frames. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "estimate/observation.h"
#include "estimate/scene_model.h"
#include "fuse/phases.h"
#include "fuse/sparse_bank.h"

namespace codedexposure::fuse
{

/** Sparse filters that predict coded pixels, under a static scene and moving
 * ones, and that estimate the slots under each of some models. */
class FilterSets
{
public:
  struct Models {
    /** Of the frame alone. With none, slots are not estimated; with several,
     * predictions are those of these. */
    std::vector<SceneClass> of_frame;
    /** In their place where there are neighbouring frames; the last one does
     * without. None: neighbouring frames are not used. */
    std::vector<SceneClass> over_frames;
  };
  struct Frames {
    int width;
    int radius;     ///< of taps, px; coded frames have a margin of this size
    int period;     ///< of the parts of rows
    float steps;    ///< see SparseBank
    bool lookahead; ///< the next coded frame is usually known
  };
  struct Set {
    SparseSources sources;
    SparseBank predictions; ///< of a static scene, then of moving ones
    std::vector<SparseBank> estimates; ///< of the slots, for each model
  };

  /** @p noise  variance of each element in units of the scene's variance. */
  FilterSets (const Phases &phases, const Observation &observation,
      Models models, std::span<const double> noise, Frames frames);

  bool estimate () const { return !models_.of_frame.empty (); }
  bool use_neighbours () const { return !models_.over_frames.empty (); }
  /** The largest number of models of a set. */
  int most_models () const;
  /** The largest number of classes that predict in a set. */
  int most_classes () const;
  /** Filters for the neighbours that there are in @p frames. Those that a
   * stream needs only at its end, or where frames are missing, are made when
   * it does. */
  const Set &for_frames (const SplitFrames &frames);

private:
  struct Around;
  const Set &set_for (Around around);
  void each_filter (const SceneClass &scene, std::span<const Tap> taps,
      Sought sought, const UseSparse &use) const;
  SparseBank make_predictions (
      const SparseSources &sources, Around around) const;
  std::vector<SparseBank> make_estimates (
      const SparseSources &sources, Around around) const;

  const Phases &phases_;
  const Observation &observation_;
  Models models_;
  std::vector<double> noise_;
  Frames frames_;
  /** Without and with taps of the previous, + 2 of the next coded frame. */
  std::array<std::optional<Set>, 4> sets_;
};

} // namespace codedexposure::fuse

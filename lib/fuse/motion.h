/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Motion-adaptive kriging. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "base/workers.h"
#include "fuse/field.h"
#include "fuse/filter_bank.h"

namespace codedexposure::fuse
{

/**
 * Under each class of patches, every coded pixel is predicted from those around
 * it, which saw other slots. The prediction of the right class is good in spite
 * of aliasing: its squared error, averaged around a block of 2x2 pixels,
 * measures how well the class fits there. The frames are the sum of the filters
 * of all classes, with weights by how well they fit.
 *
 * Some classes exist a second time, with pixels of the coded frames before and
 * after the one that is fused, and compete with the others.
 */
class MotionFilter
{
public:
  struct Classes {
    std::vector<SceneClass> of_frame;
    std::vector<SceneClass> over_frames; ///< with neighbouring frames
    /** With one of them: the one before, if there is one. */
    std::vector<SceneClass> over_one;
  };
  /** @p radius  of the taps, px; coded frames have a margin of this size.
   *  @p noise   variance of each element in units of the scene's variance.
   *  @p steps  see FilterBank. */
  MotionFilter (const Phases &phases, const Observation &observation,
      Classes classes, int radius, std::span<const double> noise, float steps);

  /** Writes the light of every slot to @p slots, fields of the size of
   * @p frames. The result does not depend on the number of workers.
   * @p misfit  null, or gets the mean squared error around each block of the
   *            class that fits best there, in grey levels squared.
   * @return  false when it was stopped. */
  bool run (const Kernels &kernels, const PairFrames &frames,
      std::span<Field> slots, Field *misfit, Workers &workers,
      std::stop_token stop);

private:
  /** Classes with the same taps. */
  struct Set {
    std::vector<float> factors; ///< of the squared error of each class
    std::vector<FilterBank>
        residuals; ///< one output per class, kChunk classes each
    std::vector<FilterBank> filters; ///< of each class, one output per slot
  };
  Set make_set (
      std::span<const SceneClass> classes, std::span<const Tap> taps) const;
  std::vector<const Set *> sets_for (const PairFrames &frames);

  struct Band;
  void measure_blocks (const Kernels &kernels, const PairFrames &frames,
      const FilterBank &residuals, Band &band) const;
  void measure (const Kernels &kernels, const PairFrames &frames,
      const Set &set, std::size_t first, Band &band) const;
  void set_weights (const Kernels &kernels, Band &band, Field *misfit) const;
  void mix (const Kernels &kernels, const PairFrames &frames, const Set &set,
      std::size_t first, Band &band, std::span<Field> slots) const;

  const Phases &phases_;
  const Observation &observation_;
  Classes classes_;
  int radius_;
  std::vector<double> noise_;
  float steps_;
  Set of_frame_;
  /** With taps of the previous, + 2 of the next coded frame. Made when they are
   * needed. */
  std::array<std::optional<Set>, 4> over_frames_;
  std::array<std::optional<Set>, 2> over_one_; ///< the previous, the next
};

} // namespace codedexposure::fuse

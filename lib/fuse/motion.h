/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Motion-adaptive kriging. */
#pragma once

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
 * of aliasing: its squared error, averaged around a pixel, measures how well
 * the class fits there. The frames are the sum of the filters of all classes,
 * with weights by how well they fit.
 */
class MotionFilter
{
public:
  /** @p radius  of the taps, px; coded frames have a margin of this size.
   *  @p noise   variance of each element in units of the scene's variance.
   *  @p steps  see FilterBank. */
  MotionFilter (const Phases &phases, const Observation &observation,
      std::span<const SceneClass> classes, int radius,
      std::span<const double> noise, float steps);

  /** Writes the light of every slot to @p slots, fields of the size of
   * @p coded. The result does not depend on the number of workers.
   * @p misfit  null, or gets the mean squared error around each pixel of the
   *            class that fits best there, in grey levels squared.
   * @return  false when it was stopped. */
  bool run (const Kernels &kernels, const PairField &coded,
      std::span<Field> slots, Field *misfit, Workers &workers,
      std::stop_token stop) const;

private:
  struct Band;
  void measure (
      const Kernels &kernels, const PairField &coded, Band &band) const;
  void set_weights (Band &band, Field *misfit) const;
  void mix (const Kernels &kernels, const PairField &coded, const Band &band,
      std::span<Field> slots) const;

  const Phases &phases_;
  std::vector<float> penalties_; ///< of fast motion, a factor on its error
  std::vector<FilterBank>
      residuals_; ///< one output per class, kChunk classes each
  std::vector<FilterBank> filters_; ///< of each class, one output per slot
};

} // namespace codedexposure::fuse

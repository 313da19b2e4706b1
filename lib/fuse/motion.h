/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The filter of the motion that fits around each pixel. */
#pragma once

#include <span>
#include <vector>

#include "base/workers.h"
#include "fuse/field.h"
#include "fuse/filter_bank.h"
#include "fuse/observation.h"
#include "fuse/scene_model.h"

namespace cexp::fuse
{

/**
 * Motion-classified kriging.
 *
 * Under each class of patches, every coded pixel is predicted from those around
 * it, which saw other slots. Where the class is right the prediction is good,
 * whatever the aliasing: its squared error, averaged around a pixel, says how
 * well the class fits there. The frames are the sum of the classes' filters,
 * weighted by how well they fit.
 */
class Motion
{
public:
  /** @p radius  of the taps, px, which the margin of coded frames must hold.
   *  @p noise   variance of each element in units of the scene's variance. */
  Motion (const Phases &phases, const Observation &observation,
      std::span<const SceneClass> classes, int radius,
      std::span<const double> noise);

  /** Writes the light of every slot to @p slots, fields of the size of
   * @p coded, the same by any number of workers; false when it was stopped. */
  bool run (const Kernels &kernels, const Field &coded, std::span<Field> slots,
      Workers &workers, std::stop_token stop) const;

private:
  struct Band;
  void measure (const Kernels &kernels, const Field &coded, Band &band) const;
  void weigh (Band &band) const;
  void mix (const Kernels &kernels, const Field &coded, const Band &band,
      std::span<Field> slots) const;

  const Phases &phases_;
  std::vector<float> penalties_;      ///< of fast motion, a factor on its error
  std::vector<FilterBank> residuals_; ///< an output a class, of a few each
  std::vector<FilterBank> filters_;   ///< of each class, an output a slot
};

} // namespace cexp::fuse

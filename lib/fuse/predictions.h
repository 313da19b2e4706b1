/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How well what lies around each pixel predicts it, under several models of
 * scenes. */
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "fuse/around.h"
#include "fuse/field.h"
#include "fuse/filter_bank.h"
#include "fuse/scene_model.h"

namespace cexp::fuse
{

/**
 * A coded pixel is predicted from its neighbours, which saw other slots, as if
 * the scene were of each class in turn. The class that is true predicts best,
 * whatever the aliasing.
 */
class Predictions
{
public:
  /** @p taps    radius of the neighbours, px, which the margin of coded frames
   *            must hold.
   *  @p around  radius of the squares over which errors are summed.
   *  @p noise   variance of each element in units of the scene's variance. */
  Predictions (const Phases &phases, const Observation &observation,
      std::span<const SceneClass> classes, int taps, int around, Extent size,
      std::span<const double> noise);

  /** Sums of squared errors around the pixels of row @p y, of each class. */
  using Use = std::function<void (int y, const float *const *errors)>;
  void run (const Kernels &kernels, const Field &coded, const Use &use);

private:
  const Phases &phases_;
  FilterBank filters_;
  Field rows_; ///< of squared errors: a class each
  std::vector<Around> sums_;
};

} // namespace cexp::fuse

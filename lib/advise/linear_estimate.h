/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The best linear estimate of every pixel in every slot, and its error. */
#pragma once

#include <vector>

#include "advise/exposure_model.h"
#include "advise/scene_statistics.h"
#include "base/geometry.h"

namespace codedexposure
{

/**
 * Simple kriging: each pixel of the full-size picture in each slot is estimated
 * from the coded pixels around it in one frame, with the least expected squared
 * error for a scene with given statistics.
 *
 * The truth is the scene at any time within the duration of the slot's
 * subframe. The error thus contains motion blur within the slot, aliasing,
 * motion until the next subframe, and noise.
 */
struct LinearEstimate {
  /** Filters for more elements would take minutes to solve. */
  static constexpr int kMaxElements = 64;

  /** @p model  of kMaxElements or fewer. Of a tile that is written out, one
   * pixel of each element represents all others. */
  LinearEstimate (const ExposureModel &model, const SceneStatistics &scene);

  /** The coded pixels around the estimated one. */
  std::vector<Offset> places;
  /** Of element e and slot s, place by place, from (e slots + s) times their
   * number on. They apply to differences of coded pixels from their means;
   * white in one slot is 1. */
  std::vector<double> weights;
  /** Mean squared error over pixels and slots; white is 1. */
  double error = 0.0;
};

} // namespace codedexposure

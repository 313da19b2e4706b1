/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Learned refinement of fused frames. */
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/workers.h"
#include "estimate/observation.h"
#include "fuse/field.h"
#include "fuse/refine_network.h"
#include "schedule/schedule.h"

namespace codedexposure::fuse
{

/**
 * Corrects the fused light of every slot by the trained network, which sees the
 * slot, the two slots before and after it, the coded frame, the slot of each
 * coded pixel and the noise. It sees one coded frame only: at both ends, the
 * end slot stands for those that are missing. Without noise, measured pixels
 * stay as they are; static ones always do.
 */
class Refiner
{
public:
  /** Why the refinement was not trained for this; empty if it was.
   * @p noise  standard deviation of coded pixels in grey levels. */
  static std::string why_not (
      const Schedule &schedule, const Observation &observation, double noise);

  Refiner (const Schedule &schedule, int width, int height, bool noise_free,
      double noise);

  /** Takes row @p y of the fused light, a row for each slot. */
  void set_row (int y, const float *const *slots);
  /** Refines what was taken, and gives it row by row.
   * @p is_static  row y of the weight of static pixels, 0 to 1.
   * False when it was stopped; nothing is given then. */
  bool run (const Kernels &kernels, const Field &coded,
      const std::function<const float *(int y)> &is_static,
      const std::function<void (int y, const float *const *slots)> &sink,
      Workers &workers, std::stop_token stop);

private:
  void refine_part (const Kernels &kernels, const Field &coded,
      const std::function<const float *(int y)> &is_static, int slot, int from,
      int to);
  void fold_row (const Field &coded, int slot, int row, float *to) const;
  void correct_row (
      const float *change, const float *is_static, int slot, int y, int part);

  int slots_, width_, height_;
  bool noise_free_;
  float noise_;
  std::vector<std::int8_t> slot_of_; ///< each pixel, row by row
  std::vector<Field> light_, refined_;
};

} // namespace codedexposure::fuse

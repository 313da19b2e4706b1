/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Learned refinement of fused frames. */
#pragma once

#include <cstdint>
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
 *
 * The network was trained without leakage. Of each coded pixel, the light that
 * leaked is undone first: it is known from the fused light of the other slots.
 */
class Refiner
{
public:
  /** Why the refinement was not trained for this; empty if it was.
   * @p noise  standard deviation of coded pixels in grey levels. */
  static std::string why_not (
      const Schedule &schedule, const Observation &observation, double noise);

  /** Largest off-state leakage that is undone. */
  static constexpr double kMaxLeak = 0.05;

  Refiner (const Schedule &schedule, const Observation &observation, int width,
      int height, double noise);

  /** Refines the fused light of every slot.
   * @p is_static  weight of static pixels, 0 to 1.
   * False when it was stopped. */
  bool run (const Kernels &kernels, const Field &coded, const Field &is_static,
      std::vector<Field> &light, Workers &workers, std::stop_token stop);

private:
  /** A fused frame. */
  struct Frame {
    const Field &coded, &is_static;
    const std::vector<Field> &light;
  };
  void undo_leakage (const Field &coded, const std::vector<Field> &light);
  void refine_part (
      const Kernels &kernels, const Frame &frame, int slot, int from, int to);
  void fold_row (const Frame &frame, int slot, int row, float *to) const;
  void correct_row (
      const Frame &frame, const float *change, int slot, int y, int part);

  int slots_, width_, height_;
  bool noise_free_;
  float leak_;  ///< off-state leakage
  float whole_; ///< light of all slots in a coded pixel, 1 from its own slot
  float noise_; ///< of a coded pixel after its leakage was undone, grey levels
  FieldOf<std::uint8_t> slot_of_; ///< of each pixel
  Field own_; ///< coded frame after its leakage was undone
  std::vector<Field> refined_;
};

} // namespace codedexposure::fuse

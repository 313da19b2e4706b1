/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Learned refinement of fused frames. */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "estimate/observation.h"
#include "fuse/bands.h"
#include "fuse/coded_stream.h"
#include "fuse/refine_network.h"
#include "schedule/schedule.h"

namespace codedexposure::fuse
{

/**
 * Corrects the fused light of every slot by the trained network, and says what
 * error it leaves. The network sees the slot, the two slots before and after it
 * (at both ends of the exposure, the end slot stands for those that are
 * missing), the mean of all slots, the coded frame and those before and after
 * it, when each coded pixel was exposed, the noise, and whether a second camera
 * saw the frame. Without noise, measured pixels stay as they are; static ones
 * always do.
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

  Refiner (const Kernels &kernels, const Schedule &schedule,
      const Observation &observation, int width, int height, double noise);

  /** Refines the fused light of every slot.
   * @p is_static   weight of static pixels, 0 to 1.
   * @p deviations  unless null, gets for each slot logarithms to base 2 of half
   *                the width of the interval of 68 % of the errors of refined
   *                pixels, in grey levels, without rounding. */
  void run (const CodedFrames &frames, const Field &is_static,
      std::vector<Field> &light, std::vector<Field> *deviations,
      const Task &task);

private:
  /** A fused frame. */
  struct Frame {
    /** Coded frames: this one, and those before and after it or null. */
    std::array<const Field *, 3> seen;
    bool pair;
    const Field &is_static;
    const std::vector<Field> &light;
    std::vector<Field> *deviations; ///< or null
  };
  void find_mean (const std::vector<Field> &light);
  /** What pixels of @p coded have of their own slots, if the other ones had
   * @p light. */
  void undo_leakage (
      const Field &coded, const std::vector<Field> &light, Field &own) const;
  void refine_part (const Frame &frame, int slot, int from, int to);
  void set_planes (const Frame &frame, int slot, int y, std::int16_t *to) const;
  void fold_row (const Frame &frame, int slot, int row, std::int16_t *planes,
      std::int16_t *to) const;
  void correct_row (
      const Frame &frame, const float *results, int slot, int y, int part);

  const Kernels &kernels_;
  int slots_, width_, height_;
  bool noise_free_;
  float leak_;  ///< off-state leakage
  float whole_; ///< light of all slots in a coded pixel, 1 from its own slot
  float noise_; ///< of a coded pixel after its leakage was undone, grey levels
  FieldOf<std::uint8_t> slot_of_; ///< of each pixel
  std::array<Field, 3> own_; ///< coded frames after their leakage was undone
  Field mean_;               ///< of all slots
  std::vector<Field> refined_;
};

} // namespace codedexposure::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Collaborative filtering: shrinkage of 3-D cosine transforms. */
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimate/observation.h"
#include "fuse/bands.h"
#include "fuse/field.h"
#include "fuse/kernels.h"

namespace codedexposure::fuse
{

/**
 * Iterated shrinkage. Overlapping blocks of 12x12 pixels x all slots have few
 * large coefficients under a cosine transform if they show one object that is
 * static or moves evenly. Each iteration sets small coefficients to 0, restores
 * the light that the coded frame has measured, and lowers the threshold.
 */
class CollaborativeFilter
{
public:
  /** @p partner  of a second camera; null: there is none. It and @p observation
   *              outlive this. */
  CollaborativeFilter (const Kernels &kernels, const Schedule &schedule,
      const Observation &observation, const Observation *partner, int width,
      int height);

  /** Improves @p slots, an estimate of the light of each slot, by @p coded. The
   * result does not depend on the number of workers.
   * @p partner  null, or what the slots are to make in the partner.
   * @p noise    standard deviation of the coded pixels' noise, grey levels. */
  void run (const Field &coded, const Field *partner, double noise,
      std::span<Field> slots, const Task &task);

private:
  /* Planes are split into every kBlockStep-th column, as the kernels expect,
   * with a mirrored border of one block. Rows are a multiple of 16 long. */
  std::size_t place (int x, int y) const;
  void split (const Field &field, std::vector<float> &plane) const;
  struct Step;
  void shrink (const Step &step, const Task &task);
  void shrink_strip (const Step &step, int strip, float *scratch);
  void update_rows (const Step &step, int first, int end);
  void correct_rows (int first, int end, const Observation &observation,
      const std::vector<float> &seen, float part);

  const Kernels &kernels_;
  const Observation &observation_;
  const Observation *partner_;
  int width_, height_;
  std::ptrdiff_t split_, stride_;
  std::vector<float> transform_;
  std::vector<std::uint8_t> elements_; ///< at every place
  std::vector<std::uint8_t> measured_; ///< slots of coded pixels that see one
  std::vector<float> coded_;
  std::vector<float> of_partner_;               ///< empty without it
  std::vector<std::vector<float>> light_, sum_; ///< of each slot
  std::vector<float> weight_;
  std::vector<std::vector<float>> scratch_; ///< of each worker
};

} // namespace codedexposure::fuse

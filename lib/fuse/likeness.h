/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What is alike in space and time, made alike. */
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/workers.h"
#include "fuse/field.h"
#include "fuse/kernels.h"
#include "fuse/observation.h"

namespace cexp::fuse
{

/**
 * Iterated shrinkage: overlapping blocks of 12x12 pixels x all slots have few
 * large coefficients under a cosine transform if they show one thing that
 * stands or moves evenly. Small ones are dropped, what the coded frame says is
 * put back, and again with a lower threshold.
 */
class Likeness
{
public:
  Likeness (const Schedule &schedule, const Observation &observation, int width,
      int height);

  /** Improves @p slots, a guess of the light of each slot, by @p coded.
   * The same by any number of workers.
   * @p noise  standard deviation of the coded pixels' noise, grey levels.
   * @return   false when it was stopped. */
  bool run (const Kernels &kernels, const Field &coded, double noise,
      std::span<Field> slots, Workers &workers, std::stop_token stop);

private:
  /* Planes are split into every fourth column, as kernels want them, with a
   * mirrored border of a block. */
  std::size_t place (int x, int y) const;
  void split (const Field &field, std::vector<float> &plane) const;
  struct Step;
  bool shrink (const Step &step, Workers &workers, std::stop_token stop);
  void shrink_strip (const Step &step, int strip, float *scratch);
  void mend_rows (int first, int end);

  const Observation &observation_;
  int width_, height_;
  std::ptrdiff_t split_, stride_;
  std::vector<float> transform_;
  std::vector<std::uint8_t> elements_; ///< of every place
  std::vector<float> coded_;
  std::vector<std::vector<float>> light_, sum_; ///< of each slot
  std::vector<float> weight_;
  std::vector<std::vector<float>> scratch_; ///< of each worker
};

} // namespace cexp::fuse

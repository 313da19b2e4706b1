/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How far fused light can be from the truth, pixel by pixel. */
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include "base/workers.h"
#include "estimate/observation.h"
#include "fuse/field.h"
#include "fuse/fuser.h"
#include "fuse/kernels.h"
#include "fuse/phases.h"
#include "fuse/static_pixels.h"

namespace codedexposure::fuse
{

/**
 * The error of an estimated pixel, whose 68 % interval is +-d:
 *
 *   d^2 = (2^offset A^misfit D^change L^roughness V^geometry)^2 + noise N
 *
 * A: mean squared error with which coded pixels around it are predicted from
 * their neighbours; D: mean squared difference of its slot from the coded frame
 * in 3x3 pixels, both less N; L: of its slot from the mean of the four
 * neighbours in 3x3 pixels; 1/4 is added to each. V: the kriging variance for
 * its position in the tile and its slot; N: the noise of a coded pixel. Units
 * are grey levels squared, 255 for white; V is relative to the scene's
 * variance.
 */
struct UncertaintyFactors {
  float offset, misfit, change, roughness, geometry, noise;
};

/** Computes the half-width of the 68 % interval of each fused pixel. */
class Uncertainty
{
public:
  /** @p scene  of V.
   *  @p depth  steps of pixels from black to white; they are rounded. */
  Uncertainty (const Schedule &schedule, const Phases &phases,
      const Observation &observation, FuseQuality quality,
      const SceneClass &scene, Extent size, double depth);

  /** To be written for each frame: A. */
  Field &misfit () { return misfit_; }
  /** Takes row @p y of the fused light, a row for each slot. */
  void set_row (int y, const float *const *slots);

  struct Frame {
    const Field &coded;
    const NoiseMap &noise;
    const StaticPixels &still;
  };
  /** Row @p y of @p slot, in grey levels. Threads may call it for different
   * slots at the same time. */
  using Sink = std::function<void (int slot, int y, const float *deviation)>;
  /** False when it was stopped. */
  bool run (const Kernels &kernels, const Frame &frame, const Sink &sink,
      Workers &workers, std::stop_token stop) const;

  /** What the deviation of a row of a slot is computed from: the logarithms to
   * base 2 of A, D, L and V, and N. Measured pixels saw the slot, and no other
   * one. For tests/quality/uncertainty. */
  struct Pixel {
    float misfit, change, roughness, geometry, noise;
    bool measured;
  };
  using Use = std::function<void (int slot, int y, const Pixel *pixels)>;
  bool each_row (const Kernels &kernels, const Frame &frame, const Use &use,
      Workers &workers, std::stop_token stop) const;

private:
  void find_geometry (const Observation &observation, const SceneClass &scene);
  void visit_slot (const Kernels &kernels, const Frame &frame, int slot,
      const Use &use) const;
  /** Squared D and L of row @p y, before their mean. */
  void differences (
      const Field &coded, int slot, int y, float *change, float *rough) const;
  float deviation (const Pixel &pixel) const;

  const Phases &phases_;
  int slots_, width_, height_;
  FuseQuality quality_;
  bool noise_free_;
  float rounding_;                   ///< variance
  std::vector<std::int8_t> slot_of_; ///< each pixel, row by row; -1: several
  std::vector<float> geometry_;      ///< by distinct row, phase and slot
  Field misfit_;
  std::vector<Field> light_; ///< of each slot
};

} // namespace codedexposure::fuse

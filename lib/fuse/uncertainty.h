/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How far fused light can be from the truth, pixel by pixel. */
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "fuse/bands.h"
#include "fuse/coded_stream.h"
#include "fuse/fuser.h"
#include "fuse/partner_fit.h"
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
 * its position in the tile and its slot, with a partner if there is one; N: the
 * noise of a coded pixel. Units are grey levels squared, 255 for white; V is
 * relative to the scene's variance. The factors of frames with a partner are
 * others. Errors of the coded pixel that are known beside its noise, as those
 * of what was rectified, are added to d^2.
 */
struct UncertaintyFactors {
  float offset, misfit, change, roughness, geometry, noise;
};

/** Computes the half-width of the 68 % interval of each fused pixel. */
class Uncertainty
{
public:
  /** @p plan   outlives this.
   *  @p depth  steps of pixels from black to white; they are rounded. */
  Uncertainty (const Schedule &schedule, const FilterPlan &plan,
      FuseQuality quality, Extent size, double depth);

  /** A fused frame. */
  struct Frame {
    const CodedFrames &frames;
    const PartnerFit *partner_fit; ///< null if there are no partners
    const NoiseMap &noise;
    const StaticPixels::Found &still;
    const Field &misfit;             ///< A, of blocks of 2x2 pixels
    const std::vector<Field> &light; ///< of each slot
    /** Logarithms to base 2 of the deviations of pixels that are not static, by
     * slot, which the network that refined them said; or null. */
    const std::vector<Field> *refined;
  };
  /** What the deviation of a pixel is computed from: the logarithms to base 2
   * of A, D, L and V, and N. Measured pixels saw the slot, and no other one. */
  struct Pixel {
    float misfit, change, roughness, geometry, noise;
    bool measured;
    bool both; ///< cameras tell of it
  };
  /** Deviations in grey levels, and what those of pixels that are not static
   * were computed from. Threads may call it for different slots at the same
   * time. */
  struct Row {
    int slot, y;
    const float *deviations;
    const Pixel *pixels;
    const float *is_static;
  };
  using Sink = std::function<void (const Row &row)>;
  void run (const Frame &frame, const Sink &sink, const Task &task) const;

private:
  void run_slot (const Frame &frame, int slot, const Sink &sink) const;
  /** Squared D and L of row @p y, before their mean. */
  void differences (
      const Frame &frame, int slot, int y, float *change, float *rough) const;
  void set_pixels (const Frame &frame, int slot, int y, const float *change,
      const float *rough, std::vector<Pixel> &pixels) const;
  void add_known (const Frame &frame, int slot, int y,
      std::span<const Pixel> pixels, float *squares) const;
  float deviation (const Pixel &pixel) const;

  const Kernels &kernels_;
  const Phases &phases_;
  int slots_;
  FuseQuality quality_;
  bool noise_free_;
  float rounding_;                ///< variance
  FieldOf<std::int16_t> slot_of_; ///< of each pixel; -1: several
  /** By phase and slot: of one camera, and of both if there are partners. */
  std::array<std::vector<float>, 2> geometry_;
};

} // namespace codedexposure::fuse

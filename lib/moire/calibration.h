/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The mapping from the frames of calibration_patterns (). */
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "moire/gratings.h"
#include "schedule/mapping.h"

namespace cexp
{

/** What a pixel is good for. */
enum class PixelQuality : std::uint8_t {
  good,
  uncovered,    ///< it sees no mirror, or the light does not reach it
  low_contrast, ///< the gratings are blurred away: out of focus
  saturated,    ///< it stood at the largest value
  outlier,      ///< it does not follow its neighbours: dust, a stuck mirror
};

/** What the fit is of. */
enum class FitModel {
  affine,
  homography,
  /** homography and, where the residuals show more than noise, a displacement
   * grid. */
  displaced,
};

struct CalibrationOptions {
  FitModel model = FitModel::displaced;
  /** Pixels from node to node of a displacement grid. */
  int node_distance = 32;
};

struct CalibrationResult {
  Mapping mapping;
  /** Blur between mirrors and pixels, standard deviation in pixels of a
   * Gaussian that explains the gratings. */
  double psf_sigma = 0.0;
  /** Variance of a pixel's number N: noise_floor + noise_slope N. */
  double noise_floor = 0.0;
  double noise_slope = 0.0;
  /** Rms of the mean residuals of blocks, as a part of what noise alone makes
   * it: 1 when the mapping leaves nothing to explain. */
  double misfit = 0.0;
  Image<PixelQuality> quality;
  /** Difference between on and off of each pixel, numbers of the camera. */
  Image<float> contrast;
  /** Mean residual of each block of kBlock x kBlock pixels, in mirrors, before
   * a displacement grid was added; 0 where it has no good pixels. */
  Image<float> residual_x, residual_y;
  static constexpr int kBlock = 16;

  std::uint64_t pixels (PixelQuality what) const;
};

/**
 * Collects the frames of a calibration run, then solves.
 *
 * Gray codes give each pixel's mirror to half a stripe, so that no period is
 * mistaken, and the gratings, moved mirror by mirror through a whole period,
 * give it to the last digit: maximum likelihood over all pixels and frames,
 * each pixel with a brightness of its own (docs/calibration.md).
 */
class Calibration
{
public:
  /** Error when @p patterns lack one that is needed, name it twice, or a size
   * is out of range. */
  static Result<Calibration> make (
      Extent camera, Extent mirrors, std::span<const Pattern> patterns);
  Calibration (Calibration &&) noexcept;
  Calibration &operator= (Calibration &&) noexcept;
  ~Calibration ();

  /** Frame of @p pattern, of the camera's size; several frames of the same
   * pattern are averaged. Error for a pattern that is not of this run. */
  Result<void> add (
      const Pattern &pattern, ImageView<const std::uint8_t> frame);
  Result<void> add (
      const Pattern &pattern, ImageView<const std::uint16_t> frame, int bits);
  /** Patterns without a frame. */
  std::vector<Pattern> missing () const;

  /** Takes seconds. Error when frames are missing or show no mirrors. */
  Result<CalibrationResult> solve (
      const CalibrationOptions &options = {}) const;

private:
  struct State;
  explicit Calibration (std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace cexp

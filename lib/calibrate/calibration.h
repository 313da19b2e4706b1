/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Solves for the mapping from the frames of calibration_patterns (). */
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "calibrate/gratings.h"
#include "calibrate/gray_fit.h"
#include "mapping/mapping.h"

namespace codedexposure
{

/** Whether a pixel took part in the fit, and why not. */
enum class PixelQuality : std::uint8_t {
  good,
  uncovered,    ///< it sees no mirror or gets no light
  low_contrast, ///< the gratings are blurred: out of focus
  saturated,    ///< it had the largest value
  outlier,      ///< it does not fit its neighbours: dust, a stuck mirror
};

struct CalibrationResult {
  Mapping mapping;
  /** Blur between mirrors and pixels, standard deviation in pixels of a
   * Gaussian that explains the gratings. */
  double psf_sigma = 0.0;
  /** Root of the reduced chi-square of the mean residuals of blocks: 1 if the
   * mapping explains everything but noise. */
  double misfit = 0.0;
  /** By how much the mirrors that pixels see by the Gray codes differ from
   * those by the mapping, in the mean over the frame, mirrors. */
  double gray_difference = 0.0;
  /** Outliers and low contrast are known of the rows of the gratings. */
  Image<PixelQuality> quality;
  /** Difference between on and off of each pixel, DN. */
  Image<float> contrast;
  /** Mean residual of each block of kBlock x kBlock pixels, in mirrors, before
   * a displacement grid was added; 0 for blocks without good pixels. */
  Image<float> residual_x, residual_y;
  static constexpr int kBlock = 16;

  std::uint64_t pixels (PixelQuality what) const;
};

/**
 * Collects the frames of a calibration run, then solves.
 *
 * Gray codes give the mirror of each pixel to within half a stripe, which
 * resolves the period. The gratings, moved mirror by mirror through a whole
 * period, refine it: the mapping is the maximum likelihood estimate from all
 * pixels and frames, where each pixel has its own brightness
 * (docs/calibration.md).
 */
class Calibration
{
public:
  /** @p row_step  of the gratings, every row of that number takes part: 1, or
   * more to save time and memory.
   * Error when @p patterns lack one that is needed or contain one twice, or a
   * size is out of range. */
  static Result<Calibration> make (Extent camera, Extent mirrors,
      std::span<const Pattern> patterns, int row_step = 1);
  /** Frame of @p pattern, of the camera's size; several frames of the same
   * pattern are averaged. Those of a Gray code and of its inverse come one
   * after the other: of a pair, only a bit of each pixel is kept.
   * @p bits  significant ones of a pixel; 0: all of its type.
   * Error for a pattern of another run, and for a frame that comes too late. */
  template <typename Pixel> // std::uint8_t or std::uint16_t
  Result<void> add (
      const Pattern &pattern, ImageView<const Pixel> frame, int bits = 0);
  /** Patterns without a frame. */
  std::vector<Pattern> missing () const;

  /** Takes seconds, and uses the frames up. Error when frames are missing or
   * show no mirrors. */
  Result<CalibrationResult> solve ();

private:
  struct Slot {
    Pattern pattern;
    Image<float> sum; ///< empty: no frame, or it is not needed any more
    int frames = 0;
    /** Of a grating that is not shown any more, every row_step_-th row, in
     * units of unit_; empty before. */
    Image<std::uint16_t> mean = {};
  };

  Calibration (Extent camera, Extent mirrors, int row_step);
  /** Null if there is none. */
  Slot *find (const Pattern &pattern);
  /** Whether all bits of the Gray code of @p axis are there, with inverses. */
  bool has_gray_code (Axis axis) const;
  /** Keeps the bits of pairs that are complete, but for that of @p pattern. */
  void evaluate_pairs (const Pattern &pattern);
  /** Keeps the means of gratings in place of their sums, but for that of
   * @p pattern. */
  void shrink_gratings (const Pattern &pattern);
  /** Sorted by phase. */
  std::vector<const Slot *> gratings (Axis axis) const;
  Result<Image<std::uint8_t>> usable_pixels (CalibrationResult &result) const;
  double gray_difference (Axis axis, const CalibrationResult &result) const;
  Result<CalibrationResult> fit ();

  Extent camera_, mirrors_;
  int row_step_;
  std::vector<Slot> slots_; ///< their sums are means in fit ()
  GrayCode gray_x_, gray_y_;
  bool solved_ = false;
  float unit_ = 1.0f; ///< of means, DN
  Image<std::uint8_t> saturated_;
};

} // namespace codedexposure

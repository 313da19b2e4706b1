/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Maximum likelihood fit of a mapping to gratings that were moved through a
 * whole period; for this folder only. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "base/image.h"
#include "calibrate/homography_fit.h"
#include "calibrate/response.h"
#include "mapping/mapping.h"

namespace codedexposure
{

/** Frames of one axis: frame k shows the grating of phase k. Row r of them is
 * row r * step of the camera. */
struct PhaseStack {
  std::vector<ImageView<const std::uint16_t>> frames;
  float unit = 1.0f; ///< of a value, DN
  int step = 1;

  int period () const { return int (frames.size ()); }
};

/** Variance of a pixel with the value N: floor + slope N. */
struct NoiseModel {
  double floor = 1.0;
  double slope = 0.01;
};

/** Likelihood and residuals of one axis of one pixel. */
struct PixelFit {
  float score = 0.0f;
  float information = 0.0f;
  float blur_score = 0.0f;
  float blur_information = 0.0f;
  float cross = 0.0f;
  float swing = 0.0f;      ///< light of on minus off, DN
  float chi_square = 0.0f; ///< squared residuals in units of the noise
};

/** State of the fit: input, and estimates that improve from round to round. */
struct PhaseFit {
  Extent camera, mirrors;
  PhaseStack x, y;
  /** Usable pixels, and their light with mirrors off and on, smoothed. */
  ImageView<const std::uint8_t> usable;
  ImageView<const float> dark, white;

  Mapping mapping;
  int frames = 1;                      ///< of which each value is the mean
  double blur_x = 0.25, blur_y = 0.25; ///< variances in mirrors squared
  NoiseModel noise = {};
  /** At first so large that there are no outliers. */
  double reduced_chi_square = 1e9;
  /** Variance of the scores, relative to the one expected from the weights. */
  double noise_ratio = 1.0;
  Mapping::Covariance covariance = {};

  /** Score and information of one block of pixels. */
  struct Block {
    double score = 0.0;
    double information = 0.0;

    void add (float more_score, float more_information)
    {
      score += double (more_score);
      information += double (more_information);
    }
  };
  int block_size = 16;
  std::vector<Block> blocks_x = {}, blocks_y = {};
  /** Pixels that do not fit the model, one byte each; of the rows that the
   * frames have. */
  Image<std::uint8_t> outlier = {};
  /** Pixels in which the gratings are blurred. */
  Image<std::uint8_t> faint = {};

  int blocks_across () const
  {
    return (camera.width + block_size - 1) / block_size;
  }
  int blocks_down () const
  {
    return (camera.height + block_size - 1) / block_size;
  }
  /** The one of @p blocks that holds pixel (@p px, @p py). */
  Block &block_at (std::vector<Block> &blocks, int px, int py) const;

  /**
   * One Gauss-Newton step of the first @p numbers numbers of the homography and
   * of the blur. With 0, only blocks, blur and chi-square change; otherwise the
   * mapping loses its displacement. Returns the largest step of the frame's
   * corners in mirrors; none if the frames do not determine a step.
   */
  std::optional<double> round (int numbers);
  /** Fits the noise to the residuals of a part of the rows. */
  void estimate_noise ();
};

} // namespace codedexposure

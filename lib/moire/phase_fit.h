/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Maximum likelihood of a mapping from gratings that were moved through a whole
 * period; for the sources of lib/moire only. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "base/image.h"
#include "moire/homography_fit.h"
#include "moire/response.h"
#include "schedule/mapping.h"

namespace cexp
{

/** Frames of one axis: frame k shows the grating of phase k. */
struct PhaseStack {
  std::vector<ImageView<const float>> frames;

  int period () const { return int (frames.size ()); }
};

/** Variance of a number: floor + slope number. */
struct NoiseModel {
  double floor = 1.0;
  double slope = 0.01;
};

/** What a round of the fit found out about one axis of one pixel. */
struct PixelFinding {
  float score = 0.0f;
  float information = 0.0f;
  float blur_score = 0.0f;
  float blur_information = 0.0f;
  float cross = 0.0f;
  float swing = 0.0f;  ///< light of on less off, numbers
  float misfit = 0.0f; ///< squared residuals in units of the noise
};

/** State of the fit; what is known when it begins, known better at its end. */
struct PhaseFit {
  Extent camera, mirrors;
  PhaseStack x, y;
  /** Pixels of any use, and their light with mirrors off and on, smoothed. */
  ImageView<const std::uint8_t> usable;
  ImageView<const float> dark, white;

  Mapping mapping;
  int frames = 1;                      ///< of which each number is the mean
  double blur_x = 0.25, blur_y = 0.25; ///< variances in mirrors squared
  NoiseModel noise = {};
  /** Mean squared residual in units of the noise; at first, nothing is too
   * much.
   */
  double misfit = 1e9;
  /** Variance of the scores, of that which weights would make it. */
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
  /** Pixels that do not follow the model, one byte each. */
  Image<std::uint8_t> outlier = {};
  /** Those in which the gratings are blurred away. */
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
   * One round: a step of the first @p numbers numbers of the homography and of
   * the blur. With 0 only blocks, blur and misfit change; else the mapping has
   * no displacement. Returns the step's length in mirrors, largest over the
   * frame's corners; none where the frames determine nothing.
   */
  std::optional<double> round (std::size_t numbers);
  /** Fits the noise to the residuals of a part of the rows. */
  void estimate_noise ();
};

} // namespace cexp

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Least squares for a homography, one observation at a time; for the sources
 * of lib/moire only. */
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "schedule/mapping.h"
#include "schedule/matrix.h"

namespace cexp
{

/** Camera places in the coordinates of Mapping::centred (). */
struct CentredFrame {
  double cx, cy, r;

  explicit CentredFrame (Extent camera);
};

/** Mirror of the centred place @p xi, @p eta; z for its derivatives. */
struct CentredMirror {
  double x, y, z;
};
CentredMirror centred_mirror (const Homography &h, double xi, double eta);

/**
 * Normal equations of the eight numbers of a centred homography and of one
 * number more for x and for y.
 */
class HomographyFit
{
public:
  static constexpr std::size_t kExtra = 8; ///< index of the one for x
  static constexpr std::size_t kNumbers = 10;

  /** What one pixel says of its mirror along one axis. */
  struct Observation {
    double score;       ///< derivative of the log-likelihood, by the mirror
    double information; ///< its variance
    double extra_score = 0.0;
    double extra_information = 0.0;
    double cross = 0.0; ///< of both
  };

  void add_x (
      double xi, double eta, const CentredMirror &at, const Observation &seen);
  void add_y (
      double xi, double eta, const CentredMirror &at, const Observation &seen);

  /** The step to the maximum and the covariance; @p numbers first of them are
   * free (6: affine, 8: homography), and the extra ones if @p extra. None where
   * the observations do not determine them. */
  struct Step {
    std::array<double, kNumbers> change = {};
    std::array<double, kNumbers *kNumbers> covariance = {};
  };
  std::optional<Step> solve (std::size_t numbers, bool extra) const;

private:
  void add (std::size_t first, double mirror, double xi, double eta, double z,
      const Observation &seen);

  std::array<double, kNumbers *kNumbers> normal_ = {}; // lower triangle
  std::array<double, kNumbers> right_ = {};
};

} // namespace cexp

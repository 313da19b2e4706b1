/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Least squares for a homography, one observation at a time; for this folder
 * only. */
#pragma once

#include <optional>

#include <Eigen/Core>

#include "mapping/mapping.h"

namespace codedexposure
{

/**
 * Normal equations of the eight numbers of a centred homography and of one
 * extra number for x and for y.
 */
class HomographyFit
{
public:
  static constexpr int kExtra = 8; ///< index of the one for x
  static constexpr int kNumbers = 10;
  using Numbers = Eigen::Vector<double, kNumbers>;
  using Square = Eigen::Matrix<double, kNumbers, kNumbers>;

  /** Likelihood of the mirror of one pixel along one axis. */
  struct Observation {
    double score;       ///< derivative of the log-likelihood, by the mirror
    double information; ///< its variance
    double extra_score = 0.0;
    double extra_information = 0.0;
    double cross = 0.0; ///< of both
  };

  /** What a pixel at (@p xi, @p eta), which sees @p at by the homography, says
   * of its mirror in x and in y. */
  void add (double xi, double eta, const Projected &at, const Observation &x,
      const Observation &y);

  /** The step to the maximum and its covariance. The first @p numbers of the
   * homography are free (6: affine, 8: all), and the extra ones if @p extra.
   * None if the observations do not determine them. */
  struct Step {
    Numbers change = Numbers::Zero ();
    Square covariance = Square::Zero ();
  };
  std::optional<Step> solve (int numbers, bool extra) const;

private:
  void add_axis (int first, double mirror, double xi, double eta, double z,
      const Observation &seen);

  Square normal_ = Square::Zero (); // lower triangle
  Numbers right_ = Numbers::Zero ();
};

} // namespace codedexposure

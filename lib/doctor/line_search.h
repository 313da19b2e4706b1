/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Looks for a periodic part of light that was seen in short pieces; for this
 * folder only. */
#pragma once

#include <vector>

#include <Eigen/Core>

#include "doctor/light_model.h"

namespace codedexposure
{

/** A time in which sample @p sample was lit and exposed, s. */
struct LitTime {
  int sample = 0;
  double weight = 1.0;
  double from = 0.0, until = 0.0;
};

struct LineSearch {
  std::vector<LitTime> lit; // in the order of the samples
  /** What remains of each sample without the line, in seconds of light times
   * its weight. */
  Eigen::VectorXd residual;
  /** What else may explain it, with the same weights: columns. */
  Eigen::MatrixXd others;

  /**
   * The frequency in [@p slowest, @p fastest] Hz that explains most of the
   * residual, once all else was fitted beside it.
   *
   * @p spectrum  if not null: which part of the squares of the residual a line
   *              explains, at most, in each of kStretches parts of the range.
   */
  LightLine strongest (double slowest, double fastest,
      std::vector<Position> *spectrum = nullptr) const;

  static constexpr int kStretches = 300;
};

} // namespace codedexposure

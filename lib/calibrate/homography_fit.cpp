/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/homography_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

namespace codedexposure
{

void
HomographyFit::add_axis (std::size_t first, double mirror, double xi,
    double eta, double z, const Observation &seen)
{
  const std::size_t extra = kExtra + first / 3;
  const std::size_t at[] = {first, first + 1, first + 2, 6, 7};
  const double gradient[] = {
      xi / z, eta / z, 1.0 / z, -mirror * xi / z, -mirror * eta / z};
  for (std::size_t i = 0; i < 5; i++) {
    const double weighted = seen.information * gradient[i];
    for (std::size_t j = 0; j <= i; j++)
      normal_[at[i] * kNumbers + at[j]] += weighted * gradient[j];
    normal_[extra * kNumbers + at[i]] += seen.cross * gradient[i];
    right_[at[i]] += seen.score * gradient[i];
  }
  normal_[extra * kNumbers + extra] += seen.extra_information;
  right_[extra] += seen.extra_score;
}

void
HomographyFit::add (double xi, double eta, const Projected &at,
    const Observation &x, const Observation &y)
{
  add_axis (0, at.x, xi, eta, at.z, x);
  add_axis (3, at.y, xi, eta, at.z, y);
}

std::optional<HomographyFit::Step>
HomographyFit::solve (std::size_t numbers, bool extra) const
{
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < kNumbers; i++)
    if (i < numbers || (i >= kExtra && extra))
      used.push_back (i);
  /* To unit diagonal, so that pivots can be compared with rounding errors. */
  std::vector<double> scale;
  for (const std::size_t i : used) {
    const double diagonal = normal_[i * kNumbers + i];
    if (!(diagonal > 0.0))
      return std::nullopt;
    scale.push_back (1.0 / std::sqrt (diagonal));
  }
  const std::size_t n = used.size ();
  Eigen::MatrixXd matrix (n, n);
  for (std::size_t i = 0; i < n; i++)
    for (std::size_t j = 0; j <= i; j++)
      matrix (Eigen::Index (i), Eigen::Index (j)) =
          scale[i] * scale[j] * normal_[used[i] * kNumbers + used[j]];
  const Eigen::LDLT<Eigen::MatrixXd> factor (matrix);
  if (factor.info () != Eigen::Success ||
      !(factor.vectorD ().minCoeff () >
          std::numeric_limits<double>::epsilon ()))
    return std::nullopt;
  const Eigen::MatrixXd inverse =
      factor.solve (Eigen::MatrixXd::Identity (matrix.rows (), matrix.rows ()));

  Step step;
  for (std::size_t i = 0; i < n; i++)
    for (std::size_t j = 0; j < n; j++) {
      const auto row = Eigen::Index (i), column = Eigen::Index (j);
      const double entry = 0.5 * scale[i] * scale[j] *
                           (inverse (row, column) + inverse (column, row));
      step.covariance[used[i] * kNumbers + used[j]] = entry;
      step.change[used[i]] += entry * right_[used[j]];
    }
  return step;
}

} // namespace codedexposure

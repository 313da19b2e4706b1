/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/homography_fit.h"

#include <limits>
#include <vector>

#include <Eigen/Cholesky>

namespace codedexposure
{

void
HomographyFit::add_axis (int first, double mirror, double xi, double eta,
    double z, const Observation &seen)
{
  const int extra = kExtra + first / 3;
  const int at[] = {first, first + 1, first + 2, 6, 7};
  const double gradient[] = {
      xi / z, eta / z, 1.0 / z, -mirror * xi / z, -mirror * eta / z};
  for (std::size_t i = 0; i < 5; i++) {
    const double weighted = seen.information * gradient[i];
    for (std::size_t j = 0; j <= i; j++)
      normal_ (at[i], at[j]) += weighted * gradient[j];
    normal_ (extra, at[i]) += seen.cross * gradient[i];
    right_[at[i]] += seen.score * gradient[i];
  }
  normal_ (extra, extra) += seen.extra_information;
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
HomographyFit::solve (int numbers, bool extra) const
{
  std::vector<int> used;
  for (int i = 0; i < kNumbers; i++)
    if (i < numbers || (i >= kExtra && extra))
      used.push_back (i);
  const Eigen::MatrixXd part = normal_ (used, used);
  /* To unit diagonal, so that pivots can be compared with rounding errors. */
  if (!(part.diagonal ().minCoeff () > 0.0))
    return std::nullopt;
  const Eigen::VectorXd scale = part.diagonal ().cwiseSqrt ().cwiseInverse ();
  const Eigen::MatrixXd matrix =
      (scale * scale.transpose ()).cwiseProduct (part);
  const Eigen::LDLT<Eigen::MatrixXd> factor (matrix);
  if (factor.info () != Eigen::Success ||
      !(factor.vectorD ().minCoeff () >
          std::numeric_limits<double>::epsilon ()))
    return std::nullopt;
  const Eigen::MatrixXd inverse =
      factor.solve (Eigen::MatrixXd::Identity (matrix.rows (), matrix.rows ()));

  const Eigen::MatrixXd covariance =
      (0.5 * scale * scale.transpose ())
          .cwiseProduct (inverse + inverse.transpose ());
  Step step;
  step.covariance (used, used) = covariance;
  step.change (used) = covariance * right_ (used);
  return step;
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/homography_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

namespace codedexposure
{

namespace
{

using Square = Eigen::Matrix<double, int (HomographyFit::kNumbers),
    int (HomographyFit::kNumbers), Eigen::RowMajor>;

} // namespace

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
  std::vector<Eigen::Index> used;
  for (std::size_t i = 0; i < kNumbers; i++)
    if (i < numbers || (i >= kExtra && extra))
      used.push_back (Eigen::Index (i));
  const Eigen::MatrixXd part =
      Eigen::Map<const Square> (normal_.data ()) (used, used);
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
  Eigen::Map<Square> (step.covariance.data ()) (used, used) = covariance;
  for (std::size_t i = 0; i < used.size (); i++)
    for (std::size_t j = 0; j < used.size (); j++)
      step.change[std::size_t (used[i])] +=
          covariance (Eigen::Index (i), Eigen::Index (j)) *
          right_[std::size_t (used[j])];
  return step;
}

} // namespace codedexposure

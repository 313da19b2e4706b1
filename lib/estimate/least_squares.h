/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Least squares of a few unknowns; each of Eigen's methods is compiled once,
 * because that takes seconds. */
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

namespace codedexposure
{

/** The normal matrix of @p rows: its transpose times itself. */
Eigen::MatrixXd normal_of (const Eigen::MatrixXd &rows);

/** x with @p normal x = @p right; @p normal is symmetric and not negative. */
Eigen::VectorXd solve_normal (
    const Eigen::MatrixXd &normal, const Eigen::VectorXd &right);

/** Has numbers that are not finite if @p square has no inverse. */
Eigen::MatrixXd inverse_of (const Eigen::MatrixXd &square);

/** Orthonormal columns that span those of @p columns. */
Eigen::MatrixXd basis_of (const Eigen::MatrixXd &columns);

/** A polynomial by weighted least squares. */
struct Polynomial {
  Eigen::VectorXd factors;
  Eigen::MatrixXd covariance;
};

/** A number that was measured at @p x. */
struct Sample {
  double x, value, sigma;
};

/** The covariance is that of the scatter, where that is more than what the
 * errors of @p samples explain. */
Polynomial fit_polynomial (const std::vector<Sample> &samples, int degree);

/** Differences of what is seen and what numbers explain, by their errors. */
using Residuals = std::function<Eigen::VectorXd (const Eigen::VectorXd &)>;

/** Residuals where they are small, or elsewhere. */
struct Minimum {
  Eigen::VectorXd numbers, residuals;
  /** Of the residuals: a column for each number. */
  Eigen::MatrixXd slopes;
  /** Of the numbers, if each residual has a variance of 1. */
  Eigen::MatrixXd covariance;
  /** Whether the residuals determine all numbers; else, the covariance is that
   * of what they do determine. */
  bool determined = false;

  double squares () const { return residuals.squaredNorm (); }
};

/** @p residuals at @p numbers. @p steps: of the numbers, for derivatives. */
Minimum evaluate (const Residuals &residuals, const Eigen::VectorXd &numbers,
    const Eigen::VectorXd &steps);

/** The minimum of the squares near @p start, by Levenberg and Marquardt. */
Minimum minimise (const Residuals &residuals, Eigen::VectorXd start,
    const Eigen::VectorXd &steps);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "estimate/least_squares.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <unsupported/Eigen/LevenbergMarquardt>

namespace codedexposure
{

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace
{

/* Residuals as Eigen wants them. */
class Problem : public Eigen::DenseFunctor<double>
{
public:
  Problem (const Residuals &residuals, const VectorXd &steps, Index count)
      : DenseFunctor (int (steps.size ()), int (count)), residuals_ (residuals),
        steps_ (steps)
  {
  }

  int operator() (const VectorXd &numbers, VectorXd &rest) const
  {
    rest = residuals_ (numbers);
    if (!rest.allFinite ())
      rest.setConstant (1e100); // nothing is worse
    return 0;
  }

  int df (const VectorXd &numbers, MatrixXd &slopes) const
  {
    VectorXd here, there, moved = numbers;
    (*this) (numbers, here);
    slopes.resize (here.size (), numbers.size ());
    for (Index i = 0; i < numbers.size (); i++) {
      moved[i] += steps_[i];
      (*this) (moved, there);
      slopes.col (i) = (there - here) / steps_[i];
      moved[i] = numbers[i];
    }
    return 0;
  }

private:
  const Residuals &residuals_;
  const VectorXd &steps_;
};

} // namespace

MatrixXd
normal_of (const MatrixXd &rows)
{
  return rows.transpose () * rows;
}

VectorXd
solve_normal (const MatrixXd &normal, const VectorXd &right)
{
  return normal.ldlt ().solve (right);
}

MatrixXd
inverse_of (const MatrixXd &square)
{
  return square.inverse ();
}

MatrixXd
basis_of (const MatrixXd &columns)
{
  const Eigen::ColPivHouseholderQR<MatrixXd> factors (columns);
  return MatrixXd (factors.householderQ ()).leftCols (factors.rank ());
}

Polynomial
fit_polynomial (const std::vector<Sample> &samples, int degree)
{
  MatrixXd rows (Index (samples.size ()), degree + 1);
  VectorXd right (rows.rows ());
  for (Index i = 0; i < rows.rows (); i++) {
    const auto &[x, value, sigma] = samples[std::size_t (i)];
    right[i] = value / sigma;
    for (int power = 0; power <= degree; power++)
      rows (i, power) = std::pow (x, power) / sigma;
  }
  Polynomial fitted;
  fitted.covariance = inverse_of (normal_of (rows));
  fitted.factors = fitted.covariance * (rows.transpose () * right);
  const double freedom = double (rows.rows () - rows.cols ());
  if (freedom > 0.0)
    fitted.covariance *= std::max (
        1.0, (right - rows * fitted.factors).squaredNorm () / freedom);
  return fitted;
}

Minimum
evaluate (
    const Residuals &residuals, const VectorXd &numbers, const VectorXd &steps)
{
  Minimum found{numbers, residuals (numbers), {}, {}};
  Problem (residuals, steps, found.residuals.size ())
      .df (numbers, found.slopes);
  /* With columns of the same length, small ones are not taken for none. */
  const VectorXd scale =
      found.slopes.colwise ().norm ().cwiseMax (1e-300).cwiseInverse ();
  const auto factors = normal_of (found.slopes * scale.asDiagonal ())
                           .completeOrthogonalDecomposition ();
  found.covariance =
      scale.asDiagonal () * factors.pseudoInverse () * scale.asDiagonal ();
  found.determined =
      factors.rank () == numbers.size () && found.covariance.allFinite ();
  return found;
}

Minimum
minimise (const Residuals &residuals, VectorXd start, const VectorXd &steps)
{
  Problem problem (residuals, steps, residuals (start).size ());
  Eigen::LevenbergMarquardt<Problem> solver (problem);
  solver.minimize (start);
  return evaluate (residuals, start, steps);
}

} // namespace codedexposure

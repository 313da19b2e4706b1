/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/solve.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

namespace codedexposure
{

using Eigen::MatrixXd;
using Eigen::VectorXd;

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

VectorXd
least_squares (const MatrixXd &rows, const VectorXd &right)
{
  return rows.colPivHouseholderQr ().solve (right);
}

MatrixXd
inverse_of (const MatrixXd &square)
{
  return square.inverse ();
}

MatrixXd
pseudo_inverse_of (const MatrixXd &square)
{
  return square.completeOrthogonalDecomposition ().pseudoInverse ();
}

MatrixXd
basis_of (const MatrixXd &columns)
{
  const Eigen::ColPivHouseholderQR<MatrixXd> factors (columns);
  return MatrixXd (factors.householderQ ()).leftCols (factors.rank ());
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Linear problems of a few unknowns; each of Eigen's factorisations is compiled
 * once, because that takes seconds. */
#pragma once

#include <Eigen/Core>

namespace codedexposure
{

/** The normal matrix of @p rows: its transpose times itself. */
Eigen::MatrixXd normal_of (const Eigen::MatrixXd &rows);

/** x with @p normal x = @p right; @p normal is symmetric and not negative. */
Eigen::VectorXd solve_normal (
    const Eigen::MatrixXd &normal, const Eigen::VectorXd &right);

/** x that minimises |@p rows x - @p right|, also if columns depend on each
 * other. */
Eigen::VectorXd least_squares (
    const Eigen::MatrixXd &rows, const Eigen::VectorXd &right);

/** Has numbers that are not finite if @p square has no inverse. */
Eigen::MatrixXd inverse_of (const Eigen::MatrixXd &square);

/** That of Moore and Penrose. */
Eigen::MatrixXd pseudo_inverse_of (const Eigen::MatrixXd &square);

/** Orthonormal columns that span those of @p columns. */
Eigen::MatrixXd basis_of (const Eigen::MatrixXd &columns);

} // namespace codedexposure

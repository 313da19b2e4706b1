/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Linear equations whose matrix is a covariance. */
#pragma once

#include <vector>

namespace cexp
{

/** A symmetric positive definite matrix, factored once: U^T U. */
class Cholesky
{
public:
  /** @p matrix  @p size x @p size, row by row; only its upper triangle is
   * read. */
  Cholesky (std::vector<double> matrix, int size);

  /** Replaces each of @p count right sides, columns of @p b, by its solution.
   */
  void solve (std::vector<double> &b, int count) const;

private:
  double *row (int i) { return upper_.data () + i * size_; }
  const double *row (int i) const { return upper_.data () + i * size_; }

  std::vector<double> upper_;
  int size_;
};

} // namespace cexp

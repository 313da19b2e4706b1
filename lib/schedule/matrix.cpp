/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/matrix.h"

#include <Eigen/LU>

namespace codedexposure
{

std::optional<Matrix>
inverted (const Matrix &a, std::size_t n)
{
  using Square =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  constexpr double kMaxResidual = 1e-6;
  const auto size = Eigen::Index (n);
  const Eigen::Map<const Square> matrix (a.data (), size, size);
  const Square inverse = matrix.partialPivLu ().inverse ();
  const Square residual = matrix * inverse - Square::Identity (size, size);
  /* NaN must fail, too. */
  if (!(residual.array ().abs () <= kMaxResidual).all ())
    return std::nullopt;
  return Matrix (inverse.data (), inverse.data () + inverse.size ());
}

} // namespace codedexposure

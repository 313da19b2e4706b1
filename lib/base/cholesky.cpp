/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/cholesky.h"

#include <cmath>

namespace cexp
{

namespace
{

/* Of right sides that lie row after row. */
void
subtract (double *to, const double *from, int count, double factor)
{
  for (int k = 0; k < count; k++)
    to[k] -= factor * from[k];
}

void
divide (double *row, int count, double by)
{
  for (int k = 0; k < count; k++)
    row[k] /= by;
}

} // namespace

/* Row by row, so that what is subtracted lies in rows. */
Cholesky::Cholesky (std::vector<double> matrix, int size)
    : upper_ (std::move (matrix)), size_ (size)
{
  for (int k = 0; k < size_; k++) {
    double *pivot = row (k);
    divide (pivot + k, size_ - k, std::sqrt (pivot[k]));
    for (int i = k + 1; i < size_; i++)
      subtract (row (i) + i, pivot + i, size_ - i, pivot[i]);
  }
}

void
Cholesky::solve (std::vector<double> &b, int count) const
{
  const auto at = [&] (int i) { return b.data () + i * count; };
  for (int i = 0; i < size_; i++) {
    for (int j = 0; j < i; j++)
      subtract (at (i), at (j), count, row (j)[i]);
    divide (at (i), count, row (i)[i]);
  }
  for (int i = size_ - 1; i >= 0; i--) {
    for (int j = i + 1; j < size_; j++)
      subtract (at (i), at (j), count, row (i)[j]);
    divide (at (i), count, row (i)[i]);
  }
}

} // namespace cexp

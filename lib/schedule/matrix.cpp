/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/matrix.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace codedexposure
{

namespace
{

void
swap_rows (Matrix &matrix, std::size_t n, std::size_t a, std::size_t b)
{
  const auto row = [&] (std::size_t r) {
    return matrix.begin () + std::ptrdiff_t (r * n);
  };
  if (a != b)
    std::swap_ranges (row (a), row (a + 1), row (b));
}

/** Row @p to -= factor times row @p from. */
void
subtract_row (Matrix &matrix, std::size_t n, std::size_t from, std::size_t to,
    double factor)
{
  for (std::size_t k = 0; k < n; k++)
    matrix[to * n + k] -= factor * matrix[from * n + k];
}

} // namespace

std::optional<Matrix>
inverted (Matrix a, std::size_t n)
{
  Matrix b (n * n);
  for (std::size_t i = 0; i < n; i++)
    b[i * n + i] = 1.0;

  for (std::size_t c = 0; c < n; c++) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < n; r++)
      if (std::abs (a[r * n + c]) > std::abs (a[pivot * n + c]))
        pivot = r;
    const double value = a[pivot * n + c];
    if (std::abs (value) < std::numeric_limits<double>::epsilon ())
      return std::nullopt;
    for (Matrix *matrix : {&a, &b}) {
      swap_rows (*matrix, n, pivot, c);
      for (std::size_t k = 0; k < n; k++)
        (*matrix)[c * n + k] /= value;
    }
    for (std::size_t r = 0; r < n; r++) {
      const double factor = a[r * n + c];
      if (r == c || factor == 0.0)
        continue;
      subtract_row (a, n, c, r, factor);
      subtract_row (b, n, c, r, factor);
    }
  }
  return b;
}

} // namespace codedexposure

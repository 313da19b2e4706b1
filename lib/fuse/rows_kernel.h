/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Sums and maxima over rows. */
#pragma once

#include "fuse/filter_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

template <typename Join>
CODEDEXPOSURE_INLINE void
join_rows (
    const float *const *rows, int rows_count, int count, float *to, Join join)
{
  int x = 0;
  for (; x + 2 * kFloats <= count; x += 2 * kFloats) {
    Floats a = load (rows[0] + x), b = load (rows[0] + x + kFloats);
    for (int i = 1; i < rows_count; i++) {
      a = join (a, load (rows[i] + x));
      b = join (b, load (rows[i] + x + kFloats));
    }
    store (to + x, a);
    store (to + x + kFloats, b);
  }
  for (; x < count; x += kFloats) {
    Floats a = load (rows[0] + x);
    for (int i = 1; i < rows_count; i++)
      a = join (a, load (rows[i] + x));
    store (to + x, a);
  }
}

inline void
sum (const float *const *rows, int rows_count, int count, float *to)
{
  join_rows (rows, rows_count, count, to,
      [] (Floats a, Floats b) CODEDEXPOSURE_INLINE_BODY { return a + b; });
}

inline void
max (const float *const *rows, int rows_count, int count, float *to)
{
  join_rows (rows, rows_count, count, to,
      [] (Floats a, Floats b)
          CODEDEXPOSURE_INLINE_BODY { return larger (a, b); });
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET

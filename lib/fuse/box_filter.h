/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Sums or maxima over the square around each pixel, row by row. */
#pragma once

#include <vector>

#include "fuse/field.h"
#include "fuse/kernels.h"

namespace codedexposure::fuse
{

/** Combines the (2 radius + 1)^2 pixels around each pixel; beyond the border,
 * the border's pixels are repeated. Only the rows that are still needed are
 * kept. */
class BoxFilter
{
public:
  /** Kernels::sum or Kernels::max. */
  using Combine = void (*) (const float *const *, int, int, float *);

  BoxFilter (int width, int height, int radius);

  int radius () const { return radius_; }
  /** Repeats the first and last pixel of @p row in its margin of radius
   * pixels. */
  void extend (float *row) const;
  /** Adds row @p y, extended; rows come in order. */
  void add_row (Combine combine, int y, const float *row);
  /** Results for row @p y; rows up to y + radius must have been added. Valid
   * until the next call. */
  const float *result (Combine combine, int y);

private:
  int width_, height_, radius_;
  Field rows_; ///< combined along x; row y at y mod (2 radius + 1)
  Field result_;
  std::vector<const float *> parts_;
};

} // namespace codedexposure::fuse

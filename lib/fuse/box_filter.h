/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Sums or maxima over the square around each pixel, row by row. */
#pragma once

#include <algorithm>
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

  BoxFilter (int width, int height, int radius)
      : width_ (width), height_ (height), radius_ (radius),
        rows_ (width, 2 * radius + 1), result_ (width, 1),
        parts_ (std::size_t (2 * radius + 1))
  {
  }

  /** Repeats the first and last pixel of @p row in its margin of radius
   * pixels. */
  void extend (float *row) const
  {
    std::fill_n (row - radius_, radius_, row[0]);
    std::fill_n (row + width_, radius_, row[width_ - 1]);
  }

  /** Adds row @p y, extended; rows come in order. */
  void add_row (Combine combine, int y, const float *row)
  {
    for (int i = -radius_; i <= radius_; i++)
      parts_[std::size_t (i + radius_)] = row + i;
    combine (parts_.data (), 2 * radius_ + 1, width_,
        rows_.row (y % (2 * radius_ + 1)));
  }

  /** Results for row @p y; rows up to y + radius must have been added. Valid
   * until the next call. */
  const float *result (Combine combine, int y)
  {
    for (int i = -radius_; i <= radius_; i++)
      parts_[std::size_t (i + radius_)] =
          rows_.row (std::clamp (y + i, 0, height_ - 1) % (2 * radius_ + 1));
    combine (parts_.data (), 2 * radius_ + 1, width_, result_.row (0));
    return result_.row (0);
  }

private:
  int width_, height_, radius_;
  Field rows_; ///< combined along x; row y at y mod (2 radius + 1)
  Field result_;
  std::vector<const float *> parts_;
};

} // namespace codedexposure::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Sums and maxima over the squares around pixels, as rows come. */
#pragma once

#include <vector>

#include "fuse/field.h"
#include "fuse/kernels.h"

namespace cexp::fuse
{

/** Joins the pixels of (2 radius + 1)^2 around each; beyond the border lies the
 * border's pixel. Rows are kept for as long as they are needed. */
class Around
{
public:
  /** Kernels::sum or Kernels::most. */
  using Join = void (*) (const float *const *, int, int, float *);

  Around (int width, int height, int radius);

  int radius () const { return radius_; }
  /** Repeats the ends of @p row in its margin of radius pixels. */
  void extend (float *row) const;
  /** Row @p y, extended; rows come in order. */
  void take (Join join, int y, const float *row);
  /** What lies around row @p y, of rows up to y + radius that were taken. Valid
   * until the next call. */
  const float *square (Join join, int y);

private:
  int width_, height_, radius_;
  Field rows_; ///< joined along themselves, row y at y mod the size of a square
  Field square_;
  std::vector<const float *> parts_;
};

} // namespace cexp::fuse

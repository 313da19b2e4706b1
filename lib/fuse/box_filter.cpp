/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/box_filter.h"

#include <algorithm>

namespace codedexposure::fuse
{

BoxFilter::BoxFilter (int width, int height, int radius)
    : width_ (width), height_ (height), radius_ (radius),
      rows_ (width, 2 * radius + 1), result_ (width, 1),
      parts_ (std::size_t (2 * radius + 1))
{
}

void
BoxFilter::extend (float *row) const
{
  std::fill_n (row - radius_, radius_, row[0]);
  std::fill_n (row + width_, radius_, row[width_ - 1]);
}

void
BoxFilter::add_row (Combine combine, int y, const float *row)
{
  for (int i = -radius_; i <= radius_; i++)
    parts_[std::size_t (i + radius_)] = row + i;
  combine (parts_.data (), 2 * radius_ + 1, width_,
      rows_.row (y % (2 * radius_ + 1)));
}

const float *
BoxFilter::result (Combine combine, int y)
{
  for (int i = -radius_; i <= radius_; i++)
    parts_[std::size_t (i + radius_)] =
        rows_.row (std::clamp (y + i, 0, height_ - 1) % (2 * radius_ + 1));
  combine (parts_.data (), 2 * radius_ + 1, width_, result_.row (0));
  return result_.row (0);
}

} // namespace codedexposure::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/around.h"

#include <algorithm>

namespace cexp::fuse
{

Around::Around (int width, int height, int radius)
    : width_ (width), height_ (height), radius_ (radius),
      rows_ (width, 2 * radius + 1), square_ (width, 1),
      parts_ (std::size_t (2 * radius + 1))
{
}

void
Around::extend (float *row) const
{
  std::fill_n (row - radius_, radius_, row[0]);
  std::fill_n (row + width_, radius_, row[width_ - 1]);
}

void
Around::take (Join join, int y, const float *row)
{
  for (int i = -radius_; i <= radius_; i++)
    parts_[std::size_t (i + radius_)] = row + i;
  join (parts_.data (), 2 * radius_ + 1, width_,
      rows_.row (y % (2 * radius_ + 1)));
}

const float *
Around::square (Join join, int y)
{
  for (int i = -radius_; i <= radius_; i++)
    parts_[std::size_t (i + radius_)] =
        rows_.row (std::clamp (y + i, 0, height_ - 1) % (2 * radius_ + 1));
  join (parts_.data (), 2 * radius_ + 1, width_, square_.row (0));
  return square_.row (0);
}

} // namespace cexp::fuse

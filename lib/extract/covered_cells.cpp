/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/covered_cells.h"

#include <algorithm>

namespace codedexposure
{

namespace
{

/* The cells that @pixels touch. */
Rect
cells_of (const Rect &pixels, Extent cell, Extent size)
{
  const int left = std::min (pixels.x / cell.width, size.width);
  const int top = std::min (pixels.y / cell.height, size.height);
  const int right =
      std::min ((pixels.right () + cell.width - 1) / cell.width, size.width);
  const int bottom = std::min (
      (pixels.bottom () + cell.height - 1) / cell.height, size.height);
  return {left, top, right - left, bottom - top};
}

} // namespace

CoveredCells::CoveredCells (const Schedule &whole, Extent size)
{
  if (whole.regions ().empty ())
    return;
  map_ = Image<std::uint8_t> (size.width, size.height);
  for (const Region &region : whole.regions ()) {
    const Rect rect =
        rects_.emplace_back (cells_of (region.rect, whole.cell (), size));
    for (int j = rect.y; j < rect.bottom (); j++)
      std::fill_n (map_.view ().row (j) + rect.x, rect.width, std::uint8_t (1));
  }
  for (int j = 0; j < size.height; j++)
    for (int i = 0; i < size.width; i++)
      if (!at (i, j) && beside (i, j))
        neighbours_.push_back ({i, j});
}

bool
CoveredCells::beside (int i, int j) const
{
  const Rect around{i - 1, j - 1, 3, 3};
  return std::any_of (rects_.begin (), rects_.end (),
      [&] (const Rect &rect) { return rect.meets (around); });
}

template <typename Pixel>
void
CoveredCells::blacken (ImageView<Pixel> subframe) const
{
  for (const Rect &rect : rects_)
    for (int j = rect.y; j < rect.bottom (); j++)
      std::fill_n (subframe.row (j) + rect.x, rect.width, Pixel (0));
}

template void CoveredCells::blacken (ImageView<std::uint8_t>) const;
template void CoveredCells::blacken (ImageView<std::uint16_t>) const;

} // namespace codedexposure

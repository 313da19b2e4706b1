/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Cells of the background that regions touch. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/* The cells that @pixels touch. */
inline Rect
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

/**
 * The cells of which a region has some pixels or all. Another code switched
 * these, so that the background's code cannot decode them.
 */
class CoveredCells
{
public:
  /** Of subframes of @p size pixels. */
  CoveredCells (const Schedule &whole, Extent size)
  {
    if (whole.regions ().empty ())
      return;
    map_ = Image<std::uint8_t> (size.width, size.height);
    for (const Region &region : whole.regions ()) {
      const Rect rect =
          rects_.emplace_back (cells_of (region.rect, whole.cell (), size));
      for (int j = rect.y; j < rect.bottom (); j++)
        std::fill_n (
            map_.view ().row (j) + rect.x, rect.width, std::uint8_t (1));
    }
    for (int j = 0; j < size.height; j++)
      for (int i = 0; i < size.width; i++)
        if (!at (i, j) && beside (i, j))
          neighbours_.push_back ({i, j});
  }

  bool any () const { return !rects_.empty (); }
  /** Whether the cell of subframe pixel (@p i, @p j) is one. */
  bool at (int i, int j) const { return any () && map_.at (i, j) != 0; }
  /** Those that are none and have one among the eight around them, row by row.
   */
  std::span<const Offset> neighbours () const { return neighbours_; }

  /** Blackens them in @p subframe. */
  template <typename Pixel>
  void blacken (ImageView<Pixel> subframe) const
  {
    for (const Rect &rect : rects_)
      for (int j = rect.y; j < rect.bottom (); j++)
        std::fill_n (subframe.row (j) + rect.x, rect.width, Pixel (0));
  }

private:
  bool beside (int i, int j) const
  {
    const Rect around{i - 1, j - 1, 3, 3};
    return std::any_of (rects_.begin (), rects_.end (),
        [&] (const Rect &rect) { return rect.meets (around); });
  }

  std::vector<Rect> rects_; // in cells
  Image<std::uint8_t> map_; // empty where there are none
  std::vector<Offset> neighbours_;
};

} // namespace codedexposure

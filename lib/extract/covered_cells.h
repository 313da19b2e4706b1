/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Cells of the background that regions touch. */
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/**
 * The cells of which a region has some pixels or all. Another code switched
 * these, so that the background's code cannot decode them.
 */
class CoveredCells
{
public:
  /** Of subframes of @p size pixels. */
  CoveredCells (const Schedule &whole, Extent size);

  bool any () const { return !rects_.empty (); }
  /** Whether the cell of subframe pixel (@p i, @p j) is one. */
  bool at (int i, int j) const { return any () && map_.at (i, j) != 0; }
  /** Those that are none and have one among the eight around them, row by row.
   */
  std::span<const Offset> neighbours () const { return neighbours_; }
  /** Blackens them in @p subframe. */
  template <typename Pixel>
  void blacken (ImageView<Pixel> subframe) const;

private:
  bool beside (int i, int j) const;

  std::vector<Rect> rects_; // in cells
  Image<std::uint8_t> map_; // empty where there are none
  std::vector<Offset> neighbours_;
};

} // namespace codedexposure

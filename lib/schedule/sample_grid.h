/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where the pixels of each element lie in a coded frame. */
#pragma once

#include <vector>

#include "schedule/schedule.h"

namespace codedexposure
{

/**
 * The true sample positions of subframes.
 *
 * Subframe pixel (i, j) of element e is coded pixel (i cell.width + d.x,
 * j cell.height + d.y), d = offset (e, i, j). Raster tiles have the same d in
 * every cell; others repeat after repeat ().width by repeat ().height cells.
 */
class SampleGrid
{
public:
  explicit SampleGrid (const Schedule &schedule);

  int elements () const { return elements_; }
  Extent cell () const { return cell_; }
  Extent repeat () const { return repeat_; }
  /** @p i, @p j: cell column and row, both >= 0. */
  Offset offset (int element, int i, int j) const
  {
    const int at = (j % repeat_.height) * repeat_.width + i % repeat_.width;
    return offsets_[std::size_t (at * elements_ + element)];
  }
  /** Size of the subframes of a coded frame; columns and rows beyond
   * the last whole cell, and the pilot's rows, belong to no subframe. */
  Extent subframe_size (int coded_width, int coded_height) const;

private:
  int elements_;
  int pilot_rows_;
  Extent cell_;
  Extent repeat_;
  std::vector<Offset> offsets_;
};

} // namespace codedexposure

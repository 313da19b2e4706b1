/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The one place where masks become mirrors. */
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "schedule/element_map.h"
#include "schedule/mirror_array.h"
#include "schedule/still_mask.h"

namespace codedexposure
{

/** Rows of mirrors; each distinct one is stored once. */
template <typename Mirror>
struct MirrorRows {
  Image<Mirror> distinct;
  std::vector<int> order; ///< distinct row of each row

  int width () const { return distinct.width (); }
  int height () const { return int (order.size ()); }
  const Mirror *row (int y) const
  {
    return distinct.view ().row (order[std::size_t (y)]);
  }
  Image<Mirror> image () const;
};

/**
 * Renders the masks of a schedule as an array of mirrors shows them.
 *
 * Rows of masks repeat with the tiles, so that a mask of any size costs little
 * more than one period of them. The tile starts where the placement's region
 * does, and so does the pilot in the region's last rows; with
 * MirrorLayout::cell, two rows of addresses are one of the tile and of the
 * pilot. (With MirrorLayout::lattice the pilot's rows are of addresses and lie
 * across the tile's, of no use to a camera.)
 */
class MaskRenderer
{
public:
  /** @p size  of the array; check_placement () must allow the placement. */
  MaskRenderer (
      const Schedule &schedule, Extent size, const Placement &placement = {});

  const Schedule &schedule () const { return map_.schedule (); }

  /**
   * Bit i of each mirror says whether it is on in mask masks[i]; bits without a
   * mask are 0.
   *
   * @p masks  indices in 0..masks () - 1, of which s + N (frame mod 2) belongs
   *           to slot s where a pilot makes two frames differ; with a negative
   *           one, all mirrors are off. No more than Mirror has bits.
   */
  template <typename Mirror>
  MirrorRows<Mirror> render (std::span<const int> masks) const;
  /** One mask: 1 on, 0 off. */
  MirrorRows<std::uint8_t> render (int mask) const
  {
    return render<std::uint8_t> ({&mask, 1});
  }

private:
  /* What a mirror shows is a number: an element, a column of the pilot, or
   * nothing. */
  using Shown = std::uint16_t;

  void fill_row (const Placement &placement, const Rect &region, int row,
      Shown *shown) const;
  std::vector<int> row_key (const Placement &placement, int row) const;

  ElementMap map_;
  MirrorRows<Shown> shown_;
};

/** A still mask at the same place: 1 on, 0 off. */
template <typename Mirror>
MirrorRows<Mirror> render_still (
    const StillMask &mask, Extent size, const Placement &placement = {});

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How a camera sees a diamond array. */
#pragma once

#include <array>
#include <vector>

#include "schedule/mask_renderer.h"

namespace codedexposure
{

/**
 * A diamond array and a camera with the pixels of the tile: pixel (x, y) looks
 * at tile_place (layout, x, y). With MirrorLayout::lattice each pixel is one
 * mirror; with the others, mirrors overlap the borders of pixels, which
 * therefore get some light of their neighbours.
 */
class DiamondView
{
public:
  explicit DiamondView (MirrorLayout layout);

  /**
   * The part of each pixel of row @p y that mirrors cover which are on, 0..1;
   * it is dark beyond the mirrors.
   * @p mirrors  by pixel of the tile.
   * @p share    mirrors.width () numbers.
   */
  void look (
      const MirrorRows<std::uint8_t> &mirrors, int y, float *share) const;

private:
  /** Part of a pixel that pixel (x + dx, y + dy) of the tile covers. */
  struct Part {
    Offset by;
    float weight;
  };

  std::array<std::vector<Part>, 2> parts_; // in even and in odd rows
};

} // namespace codedexposure

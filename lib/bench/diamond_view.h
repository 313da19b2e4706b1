/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a camera sees of mirrors that stand on their corners. */
#pragma once

#include <array>
#include <vector>

#include "schedule/mask_renderer.h"

namespace codedexposure
{

/**
 * A diamond array behind a camera whose pixels are those of the tile: pixel (x,
 * y) looks at tile_place (layout, x, y). With MirrorLayout::lattice each pixel
 * is one mirror; with the others mirrors lie across the borders of pixels,
 * which therefore see some light of their neighbours.
 */
class DiamondView
{
public:
  explicit DiamondView (MirrorLayout layout);

  /**
   * The part of each pixel of row @p y that is covered by mirrors that are on,
   * 0..1; beyond the mirrors it is dark.
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

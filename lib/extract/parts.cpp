/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/parts.h"

#include <algorithm>
#include <utility>

namespace cexp
{

template <typename Pixel>
void
blacken_regions (const Schedule &whole, int reach, ImageView<Pixel> subframe)
{
  /* Cells [first, last) along one axis, of pixels [from, to). */
  const auto cells = [reach] (int from, int to, int cell, int all) {
    const int first = std::max (0, from / cell - reach);
    const int last = std::min ((to + cell - 1) / cell + reach, all);
    return std::pair (std::min (first, last), last);
  };
  const Extent cell = whole.cell ();
  for (const Region &region : whole.regions ()) {
    const Rect &rect = region.rect;
    const auto [left, right] =
        cells (rect.x, rect.right (), cell.width, subframe.width);
    const auto [top, bottom] =
        cells (rect.y, rect.bottom (), cell.height, subframe.height);
    for (int y = top; y < bottom; y++)
      std::fill (subframe.row (y) + left, subframe.row (y) + right, Pixel (0));
  }
}

template void blacken_regions (const Schedule &, int, ImageView<std::uint8_t>);
template void blacken_regions (const Schedule &, int, ImageView<std::uint16_t>);

} // namespace cexp

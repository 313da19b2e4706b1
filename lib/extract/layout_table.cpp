/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/layout_table.h"

namespace codedexposure
{

template <typename Pixel>
LayoutTable<Pixel>::LayoutTable (const SampleGrid &grid, int lanes)
    : n_ (grid.elements ()), repeat_ (grid.repeat ()),
      elements_ (std::size_t (n_ * repeat_.height)),
      comb_ (std::size_t (repeat_.width + lanes))
{
  for (int j = 0; j < repeat_.height; j++)
    for (int e = 0; e < n_; e++)
      for (int i = 0; i < repeat_.width; i++) {
        const Offset at = grid.offset (e, i, j);
        const int place = at.y * grid.cell ().width + at.x;
        places_.push_back (std::uint8_t (place));
        elements_[std::size_t (j * n_ + place)] = std::uint8_t (e);
        identity_ = identity_ && place == e;
      }
  for (std::size_t i = 0; i < comb_.size (); i += std::size_t (repeat_.width))
    comb_[i] = Pixel (-1);
}

template class LayoutTable<std::uint8_t>;
template class LayoutTable<std::uint16_t>;

} // namespace codedexposure

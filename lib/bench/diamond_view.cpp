/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/diamond_view.h"

#include <algorithm>
#include <map>

namespace codedexposure
{

DiamondView::DiamondView (MirrorLayout layout)
{
  constexpr int kSamples = 32; // along a side of a pixel
  for (int row = 0; row < int (parts_.size ()); row++) {
    std::map<std::pair<int, int>, int> seen;
    for (int j = 0; j < kSamples; j++)
      for (int i = 0; i < kSamples; i++) {
        const double x = (i + 0.5) / kSamples - 0.5;
        const double y = row + (j + 0.5) / kSamples - 0.5;
        const Offset mirror = mirror_at (tile_place (layout, x, y));
        const Offset pixel = tile_pixel (layout, mirror.x, mirror.y);
        seen[{pixel.y - row, pixel.x}]++;
      }
    for (const auto &[by, samples] : seen)
      parts_[std::size_t (row)].push_back ({{by.second, by.first},
          float (samples) / float (kSamples * kSamples)});
  }
}

void
DiamondView::look (
    const MirrorRows<std::uint8_t> &mirrors, int y, float *share) const
{
  const int width = mirrors.width ();
  std::fill_n (share, width, 0.0f);
  for (const Part &part : parts_[std::size_t (y % 2)]) {
    const int from = y + part.by.y;
    if (from < 0 || from >= mirrors.height ())
      continue;
    const std::uint8_t *row = mirrors.row (from);
    const int first = std::max (0, -part.by.x);
    const int end = std::min (width, width - part.by.x);
    for (int x = first; x < end; x++)
      share[x] += row[x + part.by.x] != 0 ? part.weight : 0.0f;
  }
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the other beam has of the mirrors. */
#include <algorithm>

#include "base/statistics.h"
#include "bench/sick_bench.h"

namespace codedexposure
{

MirrorProgram
MirrorProgram::complement (Extent mirrors) const
{
  const auto mask_of = [&] (auto on) {
    auto mask =
        std::make_shared<Image<std::uint8_t>> (mirrors.width, mirrors.height);
    each_pixel (
        *mask, [&] (int x, int y) { mask->at (x, y) = on (x, y) ? 1 : 0; });
    return mask;
  };
  MirrorProgram other = *this;
  for (Mask &mask : other.masks)
    mask = mask_of ([&] (int x, int y) { return mask->at (x, y) == 0; });
  const std::size_t all = other.masks.size ();
  other.masks.push_back (mask_of ([] (int, int) { return true; }));
  Nanoseconds dark = 0; // so far
  for (const Stretch &stretch : stretches) {
    if (stretch.begin > dark)
      other.stretches.push_back ({dark, stretch.begin, all});
    dark = std::max (dark, stretch.end);
  }
  if (dark < periods * period)
    other.stretches.push_back ({dark, periods * period, all});
  std::ranges::sort (other.stretches, {}, &Stretch::begin);
  return other;
}

} // namespace codedexposure

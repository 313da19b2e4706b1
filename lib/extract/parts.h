/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A coded frame with regions, whose parts are extracted each by itself. */
#pragma once

#include <cstdint>

#include "base/image.h"
#include "schedule/schedule.h"

namespace cexp
{

/** The pixels of @p region in a coded frame; Schedule::check_size () has to
 * hold. */
template <typename T>
ImageView<T>
pixels_of (const Region &region, ImageView<T> coded)
{
  const Rect &rect = region.rect;
  return coded.block (rect.x, rect.y, rect.width, rect.height);
}

/** Blackens, in a subframe of the background, every pixel that depends on a
 * pixel of a region, which another code shut and opened.
 * @p reach  the extractor's. */
template <typename Pixel>
void blacken_regions (
    const Schedule &whole, int reach, ImageView<Pixel> subframe);

extern template void blacken_regions (
    const Schedule &, int, ImageView<std::uint8_t>);
extern template void blacken_regions (
    const Schedule &, int, ImageView<std::uint16_t>);

} // namespace cexp

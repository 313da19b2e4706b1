/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A coded frame with regions: each part is extracted by itself. */
#pragma once

#include "base/image.h"
#include "extract/extractor.h"
#include "schedule/schedule.h"

namespace cexp
{

/**
 * @p options for the extractor of @p part, which is background () or region ()
 * of @p whole. One exposure gives a code of many slots less light than one of
 * few. Decoding makes that good: white is white in every part, unless the
 * options say a gain. Where parts differ in light, kAuto therefore decodes even
 * what select could copy; select by name and rank leave such parts darker.
 */
ExtractOptions options_for_part (
    const Schedule &whole, const Schedule &part, const ExtractOptions &options);

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

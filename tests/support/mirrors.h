/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Masks, mirror by mirror: by the rule, and as the library renders them. */
#pragma once

#include <algorithm>
#include <numeric>

#include "dmd/plane_image.h"
#include "schedule/mask_renderer.h"
#include "schedule/pilot.h"

namespace codedexposure::test
{

/** What MaskRenderer must give, each mirror asked for by itself. @p out is the
 * whole array. */
inline void
expected_mask (const Schedule &schedule, int mask, ImageView<std::uint8_t> out,
    const Placement &placement = {})
{
  const Rect region =
      placement.region.value_or (Rect{0, 0, out.width, out.height});
  const int slot = mask % schedule.slots ();
  const int pilot = pilot_top (schedule, placement.layout, region.height);
  for (int y = 0; y < out.height; y++)
    std::fill_n (out.row (y), out.width, std::uint8_t (0));
  for (int y = 0; y < region.height; y++) {
    std::uint8_t *row = out.row (region.y + y) + region.x;
    for (int x = 0; x < region.width; x++) {
      const Offset pixel =
          tile_pixel (placement.layout, x, y, placement.odd_rows_left);
      row[x] = y < pilot ? schedule.on (pixel.x, pixel.y, slot)
                         : pilot_on (x, mask, schedule.slots ());
    }
  }
}

/** The mirrors of a mask. */
inline Image<std::uint8_t>
rendered_mask (const Schedule &schedule, int mask, Extent size,
    const Placement &placement = {})
{
  return MaskRenderer (schedule, size, placement).render (mask).image ();
}

/** Image @p image of @p plan. */
inline MirrorRows<PlanePixel>
rendered_planes (const Schedule &schedule, const PlanePlan &plan, int image,
    Extent size, const Placement &placement = {})
{
  return MaskRenderer (schedule, size, placement)
      .render<PlanePixel> (plan.of_image (image));
}

/** Rows of an image, taken to differ all. */
template <typename Mirror>
MirrorRows<Mirror>
rows_of (const Image<Mirror> &image)
{
  MirrorRows<Mirror> rows{
      image, std::vector<int> (std::size_t (image.height ()))};
  std::iota (rows.order.begin (), rows.order.end (), 0);
  return rows;
}

} // namespace codedexposure::test

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Binary masks packed as the planes of 24-bit images. */
#pragma once

#include <cstdint>
#include <vector>

#include "dmd/erle.h"
#include "dmd/mirror_array.h"
#include "schedule/still_mask.h"

namespace cexp
{

constexpr int kPlanesPerImage = 24;

/** Up to 24 masks of one array. */
using PlaneImage = Image<PlanePixel>;

/** Where a mask is: a plane of an image. */
struct PlaneSlot {
  int image = 0;
  int plane = 0;
  bool operator== (const PlaneSlot &) const = default;
};

/** How the masks of a schedule are packed into images. */
struct PlanePlan {
  std::vector<PlaneSlot> masks; ///< of each mask of the schedule
  int images = 0;
};

/**
 * Packs 24 masks an image, planes filled from 0, in the order of the first
 * pixel of the tile that they open. Where a code opens few elements at a time,
 * an image then has masks of neighbouring rows of the tile, and its other rows
 * are dark and cost nothing; in the order of the slots, a bit-reversed schedule
 * would light every row of every image.
 */
PlanePlan plan_planes (const Schedule &schedule);

/** The masks that @p plan puts into image @p image, on an array of @p size. */
PlaneImage render_planes (const Schedule &schedule, const PlanePlan &plan,
    int image, const Placement &placement, Extent size);

/** One mask that stands still, in plane 0. */
PlaneImage render_still (
    const StillMask &mask, const Placement &placement, Extent size);

/** Columns [x, x + width) of @p image. */
ImageView<const PlanePixel> columns (
    ImageView<const PlanePixel> image, int x, int width);

/** A digest of the pixels (128 bits, for equality among a device's images; no
 * protection against forgery). */
struct PlaneDigest {
  std::uint64_t high = 0;
  std::uint64_t low = 0;
  bool operator== (const PlaneDigest &) const = default;
};
PlaneDigest digest (ImageView<const PlanePixel> image);

/** Of all mirrors of a mask, on an array of any one size and placement: masks
 * are equal where their digests are, whatever schedules they belong to. */
PlaneDigest digest_mask (const Schedule &schedule, int mask);

} // namespace cexp

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Binary masks packed as the planes of 24-bit images. */
#pragma once

#include <cstdint>
#include <vector>

#include "dmd/erle.h"
#include "schedule/schedule.h"

namespace codedexposure
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

  /** The mask in each plane of an image; -1: none. */
  std::vector<int> of_image (int image) const;
};

/**
 * Packs 24 masks an image, planes filled from 0, in the order of the first
 * pixel of the tile that they open. Where a code opens few elements at a time,
 * an image then has masks of neighbouring rows of the tile, and its other rows
 * are dark and cost nothing; in the order of the slots, a bit-reversed schedule
 * would light every row of every image.
 */
PlanePlan plan_planes (const Schedule &schedule);

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

} // namespace codedexposure

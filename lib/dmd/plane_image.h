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

/** A plane of an image. */
struct PlaneSlot {
  int image = 0;
  int plane = 0;
  bool operator== (const PlaneSlot &) const = default;
};

/** The places of the masks of a schedule in images. */
struct PlanePlan {
  std::vector<PlaneSlot> masks; ///< of each mask of the schedule
  int images = 0;

  /** The mask in each plane of an image; -1: none. */
  std::vector<int> of_image (int image) const;
};

/**
 * Packs 24 masks into each image, from plane 0 on, in the order of the first
 * pixel of the tile that they turn on. If a code turns on few elements at a
 * time, an image then has masks of neighbouring rows of the tile, and its other
 * rows are off and take almost no bytes; in the order of the slots, a
 * bit-reversed schedule would need every row of every image.
 */
PlanePlan plan_planes (const Schedule &schedule);

/** 128 bits that identify the mirrors of a mask; no protection against forgery.
 */
struct PlaneDigest {
  std::uint64_t high = 0;
  std::uint64_t low = 0;
  bool operator== (const PlaneDigest &) const = default;
};
/** On an array of one size and placement, masks of any schedules are equal if
 * their digests are. */
PlaneDigest digest_mask (const Schedule &schedule, int mask);

} // namespace codedexposure

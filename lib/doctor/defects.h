/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Pixels, mirrors and dust that differ from what surrounds them. */
#pragma once

#include <cstdint>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"

namespace codedexposure
{

/** Neighbouring pixels that differ from their surroundings. */
struct DefectSpot {
  Position centre; ///< pixel
  int pixels = 0;
  /** Light that is missing or too much, in units of one pixel's light. */
  double light = 0.0;
};

struct Defects {
  std::vector<Offset> hot;  ///< pixels with a signal without light
  std::vector<Offset> dead; ///< pixels that do not see light
  std::vector<DefectSpot> stuck_on, stuck_off; ///< mirrors
  std::vector<DefectSpot> dust;                ///< larger than a mirror
  /** Standard deviation of the light of neighbouring pixels, as a part of it.
   */
  double spread = 0.0;
  /** 1: a pixel that sees mirrors, and that has no defect nearby. */
  Image<std::uint8_t> good;
};

/**
 * Compares pictures with all mirrors off and on.
 *
 * A hot pixel is brighter in both; a stuck mirror is seen in one of them, by
 * one pixel or a few, by which the others do not differ. @p off, @p on: means
 * of frames, DN, of the same size.
 * @p largest: the largest DN. @p mirror: pixels that a mirror covers.
 */
Defects find_defects (const Image<float> &off, const Image<float> &on,
    int largest, double mirror = 1.0);

} // namespace codedexposure

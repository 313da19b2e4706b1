/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Projections of one plane to another. */
#pragma once

#include <algorithm>
#include <array>

#include "base/geometry.h"

namespace codedexposure
{

/** 3 x 3, row by row. */
using Homography = std::array<double, 9>;

/** Where a homography puts a place, and the Z by which it was divided. */
struct Projected {
  double x, y, z;
};

inline Projected
project (const Homography &h, double x, double y)
{
  const double z = h[6] * x + h[7] * y + h[8];
  return {
      (h[0] * x + h[1] * y + h[2]) / z, (h[3] * x + h[4] * y + h[5]) / z, z};
}

/** The coordinates of Mapping::centred (): the place (cx + r xi, cy + r eta) of
 * a frame is (xi, eta), with (cx, cy) its centre and r half its longer side. */
struct CentredFrame {
  double cx, cy, r;

  explicit CentredFrame (Extent size)
      : cx (0.5 * (size.width - 1)), cy (0.5 * (size.height - 1)),
        r (std::max (0.5, std::max (cx, cy)))
  {
  }
};

} // namespace codedexposure

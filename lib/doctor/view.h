/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Roughly where the camera looks, from a few frames. */
#pragma once

#include <string>

#include "doctor/stack.h"

namespace codedexposure
{

/** How the picture lies on the mirrors, to the nearest right angle. */
struct ViewOrientation {
  bool flipped_x = false, flipped_y = false;
  int turned = 0; ///< degrees, from x to y: 0, 90, 180 or 270
};

/** Mirrors that the camera sees, by an affine mapping. */
struct CoarseView {
  /** mirror = (xx x + xy y + x0, yx x + yy y + y0) of pixel (x, y). */
  double xx = 1.0, xy = 0.0, x0 = 0.0, yx = 0.0, yy = 1.0, y0 = 0.0;

  Position mirror_at (Position pixel) const
  {
    return {xx * pixel.x + xy * pixel.y + x0, yx * pixel.x + yy * pixel.y + y0};
  }
  double area () const { return xx * yy - xy * yx; }
  double pixels_per_mirror () const;
  ViewOrientation orientation () const;
};

/**
 * Shows masks whose mirrors are on at random, more of them to the right and to
 * the bottom: the light of a pixel tells its place.
 *
 * @p off, @p on: means with all mirrors off and on. @p good: pixels that count.
 * @p part: of the exposure in which the mirrors of @p on are on. Error when too
 * few pixels see mirrors.
 */
Result<CoarseView> look_where (Examination &examination,
    const Image<float> &off, const Image<float> &on,
    ImageView<const std::uint8_t> good, double part = 1.0);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Pose, perspective and distortion from places that belong together. */
#pragma once

#include <optional>
#include <vector>

#include "setup/bench_profile.h"

namespace codedexposure
{

/** A place of the camera and the mirror that it sees. */
struct PlacePair {
  Position pixel, mirror;
};

/** A camera that looks at a plane through a lens with radial distortion. */
struct LensFit {
  Measured rotation;         ///< degrees, from x to y
  Measured magnification;    ///< pixels a mirror
  Measured shift_x, shift_y; ///< mirrors, of the centre of the frame
  /** How much further away the right, or the lower, border looks than the
   * centre, as a part of the distance. */
  Measured tilt_x, tilt_y;
  /** Radial shift of a corner of the frame, as a part of its distance from the
   * centre. */
  Measured distortion;
  double rms = 0.0; ///< of the residuals in x and in y, mirrors
};

/** By least squares. None with fewer than 9 pairs, or if they do not determine
 * it. @p noise: least standard deviation of a place, mirrors. */
std::optional<LensFit> fit_lens (const std::vector<PlacePair> &pairs,
    Extent camera, Extent mirrors, double noise);

} // namespace codedexposure

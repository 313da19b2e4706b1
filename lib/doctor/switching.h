/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How long mirrors take to move, as the camera sees it. */
#pragma once

#include <vector>

#include "doctor/stack.h"

namespace codedexposure
{

/** Light of mirrors that were told to go off at a time. */
struct SwitchPoint {
  double time = 0.0;  ///< s, from any moment on
  double light = 0.0; ///< DN
  double sigma = 1.0;
  double from = 0.0; ///< when they went on, s; 0: all at the same time
  /** What each known line of the lamp adds, as cosine and sine of unit size:
   * its phase is another one in each look. As many in all points. */
  std::vector<double> flicker = {};
};

/**
 * The time of a linear transition, s, from mirrors that go off before, during
 * and after the end of an exposure: light grows with the time until the
 * transition ends after the exposure does. The slower the mirrors, the rounder
 * the bend. @p jitter of the exposure, s rms, rounds it, too.
 */
Measured fit_switching (
    const std::vector<SwitchPoint> &points, double jitter = 0.0);

/** Makes the points and fits them, s. @p dark: mean with all mirrors off. */
Result<Measured> measure_switching (Examination &examination,
    const Image<float> &dark, ImageView<const std::uint8_t> good,
    std::vector<SwitchPoint> &points);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The photon transfer of a sensor: noise and response against light, as in the
 * standard EMVA 1288. */
#pragma once

#include <optional>
#include <vector>

#include "setup/bench_profile.h"

namespace codedexposure
{

/** Pixels under one amount of light; DN without what rounding does. */
struct TransferPoint {
  double light = 0.0; ///< any unit; 0: none at all
  Measured mean;      ///< DN
  /** DN squared, over time; absent: rounding hides it. */
  std::optional<Measured> variance = {};
};

/** What follows from the points. */
struct PhotonTransfer {
  Measured conversion_gain; ///< e-/DN, at little light
  Measured read_noise;      ///< e- rms
  Measured read_variance;   ///< e- squared; its value may be negative
  /** DN without light, and more DN for light: dark + slope x + bow x^2. */
  Measured dark;
  double slope = 0.0, bow = 0.0;
  double bow_sigma = 0.0;

  /** Sets the read noise from the variance without light, DN squared. */
  void set_floor (const Measured &variance);
  double number_of (double light) const
  {
    return dark.value + (slope + bow * light) * light;
  }
  /** The inverse of number_of (). */
  double light_of (double number) const;
  /** Electrons of a pixel with that number, without those of noise. */
  Measured electrons_of (double number) const
  {
    const double numbers = slope * light_of (number);
    return {conversion_gain.value * numbers, conversion_gain.sigma * numbers};
  }
  /** The largest deviation from the straight line that has the same numbers
   * without light and at @p largest, DN, of the points and between them. */
  Measured deviation (
      const std::vector<TransferPoint> &points, double largest) const;
};

/**
 * A parabola through the means; and a line through the variances over the
 * light, where each electron counts the same. None with fewer than four points
 * that have a variance, or if means or noise do not grow with light.
 */
std::optional<PhotonTransfer> fit_photon_transfer (
    const std::vector<TransferPoint> &points);

} // namespace codedexposure

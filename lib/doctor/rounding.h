/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Mean and variance of pixel values before they were rounded to whole DN. */
#pragma once

#include <optional>
#include <vector>

namespace codedexposure
{

/** Of many pixels that get the same light, over many frames, in DN. */
struct Moments {
  double mean = 0.0;
  /** Over time, the mean of that of the pixels. */
  double variance = 0.0;
  /** Third central moment over time; that of photons is their variance, in
   * electrons. */
  double third = 0.0;
};

/** Of the rounded values of one pixel. */
struct RoundedMoments {
  double mean = 0.0, variance = 0.0;
  double fourth = 0.0; ///< central
};

/** What rounding makes of almost Gaussian noise, whose third central moment is
 * @p third; there are no values below 0. */
RoundedMoments rounded_moments (double mean, double sigma, double third);

/** Differences of the pixels' means from their common mean, DN: equally many
 * pixels have each. Empty: there are none. */
using Offsets = std::vector<double>;

/** What rounding makes of almost Gaussian noise; without the third moment. */
Moments rounded (const Moments &exact, const Offsets &offsets);

/**
 * The inverse of rounded (). None where the noise is too small for that: less
 * than 0.35 DN, which rounding hides. @p third: moment before rounding.
 */
std::optional<Moments> unrounded (
    const Moments &seen, const Offsets &offsets, double third = 0.0);

} // namespace codedexposure

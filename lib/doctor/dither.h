/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The dark that rounding to whole DN hides: mirrors give the pixels light of
 * parts of a DN, so that some pixels are always where noise tips the rounding.
 */
#pragma once

#include <optional>
#include <vector>

#include "doctor/photon_transfer.h"
#include "doctor/stack.h"

namespace codedexposure
{

/** Pixels that get about the same light in a look. */
struct DitherGroup {
  int look = 0;
  bool longer = false; ///< in the longest exposure, else in a short one
  double light = 0.0;  ///< from mirrors that are on, DN but for a factor
  double field = 1.0;  ///< part of the off light that these pixels get
  double mean = 0.0;   ///< as seen, DN
  /** As seen, over time, the mean of that of the pixels, DN squared. */
  double variance = 0.0;
  double spread = 0.0; ///< variance of the pixels' means, DN squared
  double pixels = 0.0;
  int frames = 0;
};

/** The dark before rounding. */
struct Dark {
  Measured black;    ///< without light, DN
  Measured off;      ///< light of mirrors that are off, longest exposure, DN
  Measured variance; ///< without light, over time, DN squared; may be negative
};

/**
 * Fits what rounding makes of the dark and of some light to @p groups of any
 * number of looks, each of which has its own factor of light. Pixels may differ
 * in their black levels.
 *
 * @p part: of the off light that a short exposure has. @p gain: e-/DN; light of
 * x DN has the variance x / gain. @p off: a first guess, DN. None if the groups
 * do not determine the numbers.
 */
std::optional<Dark> fit_dither (const std::vector<DitherGroup> &groups,
    double part, const Measured &gain, std::optional<double> off = {});

/** What is seen in a look. */
struct DitherSight {
  Dark dark;
  StackMeans shorter; ///< of all pixels, in a short exposure
};

/**
 * Shows half of the columns of mirrors, at random, in short and in long
 * exposures. None if that does not determine the dark.
 *
 * @p fine: as of fine_slots (). @p top: slots of it that do not saturate. @p
 * dark, @p bright: means with all mirrors off, and on for so long. @p good:
 * pixels that count. @p transfer: of the sensor, as far as it is known, with
 * light in slots.
 */
Result<std::optional<DitherSight>> measure_dither (Examination &examination,
    const Examination::Lit &fine, int top, const Image<float> &dark,
    const Image<float> &bright, ImageView<const std::uint8_t> good,
    const PhotonTransfer &transfer);

} // namespace codedexposure

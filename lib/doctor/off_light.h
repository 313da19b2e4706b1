/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The light of mirrors that are off, apart from the black level. */
#pragma once

#include "doctor/stack.h"

namespace codedexposure
{

/** Two exposure times, with the mirrors off but for a pedestal. */
struct OffLight {
  /** DN that mirrors that are off add in the longest exposure. */
  Measured light;
  /** The part of it that the short exposure has. */
  double part = 0.0;
  StackMeans longest, shorter; ///< means of pixels
};

/**
 * Light of mirrors that are off grows with the exposure time, and the black
 * level does not. The @p pedestal is the same in both exposures: it gives
 * rounding the noise that it needs (0: none).
 *
 * @p frames: of each exposure time. @p fine: as of fine_slots (). @p good:
 * pixels that count. @p parts: as of light_parts (). @p pedestal_light: that of
 * the pedestal, DN.
 */
Result<OffLight> measure_off_light (Examination &examination, int frames,
    const Examination::Lit &fine, int pedestal,
    ImageView<const std::uint8_t> good, const Image<float> &dark,
    const std::vector<double> &parts, double pedestal_light);

/** Offsets of pixels that get @p light DN in the mean. */
std::vector<double> offsets_of (const std::vector<double> &parts, double light);

/** Slots of @p fine whose light of @p slot DN each makes enough noise for
 * rounding, if @p gain (e-/DN) is right and @p variance is that of the dark. */
int pedestal_for (
    const Examination::Lit &fine, double slot, double gain, double variance);

} // namespace codedexposure

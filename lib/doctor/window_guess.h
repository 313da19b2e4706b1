/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where an exposure roughly is, from light in one tile of the frame period
 * after the other; for this folder only. */
#pragma once

#include <span>

#include "doctor/light_fit.h"

namespace codedexposure
{

/** The window of exposure 0, to a hundredth of @p period (s). */
LightModel guess_window (std::span<const LightSample> samples, double period);

/**
 * The length of exposure 1, s, where all else of @p model is known, but for the
 * light of mirrors that are off: it grows with the exposure, by as much as the
 * offset at most.
 */
double guess_length (std::span<const LightSample> samples, LightModel model);

} // namespace codedexposure

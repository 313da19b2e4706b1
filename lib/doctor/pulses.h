/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Whether the lamp is switched faster than flicker is looked for. */
#pragma once

#include "doctor/checks.h"

namespace codedexposure
{

/**
 * Shows runs of some milliseconds at some places of the exposure, and
 * compares their light with what the check of the trigger says of it. A lamp
 * that is dimmed by pulses gives them different parts of a pulse.
 *
 * Of the light of a run that is switched: rms, s. Not measured where the light
 * is not known, frames lack, or the frame period is too short.
 */
Result<Measured> measure_pulses (Examination &examination);

/** What happens to the light within a frame period. */
enum class Steadiness { steady, flickers, pulsed };
/** The same for where nothing is known of the exposure: "pulsed" if the light
 * of a millisecond changes from place to place by much more than that of an
 * eighth of the period. */
Result<Steadiness> steadiness_of (Examination &examination);

} // namespace codedexposure

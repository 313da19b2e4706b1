/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The phase of the masks, read from the pilot. */
#pragma once

#include <array>

#include "schedule/pilot.h"
#include "sync/phase_reading.h"

namespace codedexposure
{

/**
 * The phase that a frame's pilot shows.
 *
 * Columns are told lit from dark among themselves, so that neither the light of
 * the scene nor that of mirrors that are off matters. A frame whose lit columns
 * have masks of one of the pilot's two frames is in phase; others are lit only
 * by masks that stand in slots that are not theirs.
 *
 * @p slots  of the schedule.
 * @p means  of the pilot's columns, in counts.
 */
PhaseReading read_pilot (
    int slots, const std::array<double, kPilotColumns> &means);

} // namespace codedexposure

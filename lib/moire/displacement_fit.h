/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A displacement grid from what is left of blocks of pixels; for the sources of
 * lib/moire only. */
#pragma once

#include <span>

#include "moire/phase_fit.h"
#include "schedule/mapping.h"

namespace cexp
{

/** Squared residuals of the blocks in units of their noise, of those that noise
 * alone leaves; @p noise_ratio as in PhaseFit. */
double excess (std::span<const PhaseFit::Block> blocks, double noise_ratio);

/** Adds to @p grid, of one axis's numbers @p nodes, what the blocks say. Where
 * there are no blocks it is smooth. */
void add_displacement (Displacement &grid, std::vector<double> &nodes,
    std::span<const PhaseFit::Block> blocks, int block_size, Extent camera);

} // namespace cexp

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Fits a displacement grid to the residuals of blocks of pixels; for this
 * folder only. */
#pragma once

#include <span>

#include "calibrate/phase_fit.h"
#include "mapping/mapping.h"

namespace codedexposure
{

/** Reduced chi-square of the blocks: 1 if noise explains their residuals.
 * @p noise_ratio  as in PhaseFit. */
double reduced_chi_square (
    std::span<const PhaseFit::Block> blocks, double noise_ratio);

/** Adds the displacements of the blocks to @p nodes, the nodes of one axis of
 * @p grid. Between the blocks it is smooth. */
void add_displacement (const Displacement &grid, std::vector<double> &nodes,
    std::span<const PhaseFit::Block> blocks, int block_size, Extent camera);

} // namespace codedexposure

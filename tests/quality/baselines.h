/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Methods that fused frames are compared with: simple interpolations and
 * another kind of coding. */
#pragma once

#include <vector>

#include "scene.h"
#include "schedule/schedule.h"
#include "trial.h"

namespace codedexposure::quality
{

/** Every slot of every coded frame of a one-hot schedule by cubic convolution
 * (Keys, 1981) along the two shortest vectors between the pixels that saw it.
 */
std::vector<Picture> bicubic_frames (
    const std::vector<Picture> &coded, const Schedule &schedule);

/** The method of the paper: the ranks of a staircase, each enlarged by cubic
 * convolution around the centres of the cells. @p normalised: rank k times n /
 * k. */
std::vector<Picture> rank_frames (const std::vector<Picture> &coded,
    const Schedule &schedule, bool normalised);

/**
 * Independent random masks, half of the mirrors open in each of @p slots
 * slots, reconstructed by generalised alternating projection with total
 * variation (Yuan, 2016): 60 accelerated iterations of 5 steps of Chambolle's
 * algorithm at weight 0.1, each coded frame alone.
 */
std::vector<Picture> gap_tv_frames (
    const Scene &scene, int slots, const Condition &condition);

} // namespace codedexposure::quality

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The tables of docs/fusion-method.md. */
#pragma once

#include <string>
#include <vector>

#include "figures.h"
#include "fusion.h"
#include "scene.h"
#include "table.h"

namespace codedexposure::quality
{

/** The schedule that is measured for @p n slots, 4 or 8. */
Schedule fusion_schedule (int n, const std::string &leak = "0");

/** Frames of a clip that the tables of sequences and of the refinement use. */
constexpr int kSequenceFrames = 32;
/** Frames after these, on which they can depend. */
constexpr int kFramesAfter = 8;

/** PSNR and SSIM, flicker and texture of fused frames and of what they are
 * compared with on the first @p frames frames of every scene, clean and noisy:
 * means over frames, and over scenes. */
std::vector<Table> fusion_tables (
    const std::vector<Scene> &scenes, int frames, const Progress &progress);

/** The first frame of every scene as a static scene: PSNR and standard
 * deviation over the slots of the third coded frame. */
Table still_fusion_table (
    const std::vector<Scene> &scenes, const Progress &progress);

/** PSNR of frames 8 to 31 of every scene that has as many, in all and by slot,
 * clean and noisy. */
std::vector<Table> sequence_tables (
    const std::vector<Scene> &scenes, const Progress &progress);

/** What the refinement changes the PSNR by in up to kSequenceFrames frames of
 * every clip and of drawn scenes, clean and noisy. */
std::vector<Table> refinement_tables (
    const std::vector<Scene> &clips, const Progress &progress);

/** Mean PSNR of up to kSequenceFrames frames of every scene by the off-state
 * leakage, which the schedule has, clean and noisy. */
Table leakage_table (
    const std::vector<Scene> &scenes, const Progress &progress);

/** Mean PSNR of the first 8 frames of every scene by the blur of the lens of an
 * aligned camera, whose mapping has it or not, clean and noisy. */
Table blur_table (const std::vector<Scene> &scenes, const Progress &progress);

} // namespace codedexposure::quality

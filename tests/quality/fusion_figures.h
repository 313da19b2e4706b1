/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The tables of docs/fusion.md. */
#pragma once

#include <vector>

#include "figures.h"
#include "fusion.h"
#include "scene.h"
#include "table.h"

namespace codedexposure::quality
{

/** The schedule that is measured for @p n slots, 4 or 8. */
Schedule fusion_schedule (int n);

/** PSNR and SSIM of fused frames and of what they are compared with on the
 * first @p frames frames of every scene, clean and noisy: means over frames,
 * and over scenes. */
std::vector<Table> fusion_tables (
    const std::vector<Scene> &scenes, int frames, const Progress &progress);

/** The first frame of every scene as a static scene: PSNR and standard
 * deviation over the slots of the third coded frame. */
Table still_fusion_table (
    const std::vector<Scene> &scenes, const Progress &progress);

/** Mean PSNR of `fast` over the first @p frames frames of drawn scenes and of
 * @p clips, clean, for scene models near the current one: a basis for the
 * choice of SceneModel. */
Table training_table (
    const std::vector<Scene> &clips, int frames, const Progress &progress);

} // namespace codedexposure::quality

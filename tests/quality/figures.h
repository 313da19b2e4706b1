/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The tables of docs/quality.md. */
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "scene.h"
#include "table.h"

namespace codedexposure::quality
{

/** Called before each step, to report progress. */
using Progress = std::function<void (const std::string &what)>;

/** PSNR of every method and schedule on every scene, one table for each truth
 * and condition. */
std::vector<Table> method_tables (
    const std::vector<Scene> &scenes, const Progress &progress);

/** The part of the pixels that rank assigns to the wrong slot. */
Table mislabelled_table (
    const std::vector<Scene> &scenes, const Progress &progress);

/** The effect of off-state leakage, known and unknown. */
std::vector<Table> leak_tables (
    const std::vector<Scene> &scenes, const Progress &progress);

/** The effect of misaligned mirrors. */
std::vector<Table> shift_tables (
    const std::vector<Scene> &scenes, const Progress &progress);

/** The mean over the first 8 slots of @p scenes, coded frame by coded frame,
 * beside the figures of an independent calculation. */
Table comparison_table (const std::vector<Scene> &scenes);

/** Mean grey and entropy of the ranks of a staircase, for the first frame of
 * each scene as a static scene. */
Table still_table (const std::vector<Scene> &scenes);

/** Light efficiency of a code, and the signal-to-noise ratio of its subframes
 * on a flat grey at the same light. */
Table light_table ();

} // namespace codedexposure::quality

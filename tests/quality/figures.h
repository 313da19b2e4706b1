/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The tables of docs/quality.md. */
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "scene.h"
#include "table.h"

namespace cexp::quality
{

/** Told before each piece of work, for people who wait. */
using Progress = std::function<void (const std::string &what)>;

/** PSNR of every method and schedule on every scene, one table for each truth
 * and condition. */
std::vector<Table> method_tables (
    const std::vector<Scene> &scenes, const Progress &progress);

/** The part of the pixels that rank takes for those of another slot. */
Table mislabelled_table (
    const std::vector<Scene> &scenes, const Progress &progress);

/** What mirrors that leak light when off cost, known and unknown. */
std::vector<Table> leak_tables (
    const std::vector<Scene> &scenes, const Progress &progress);

/** What mirrors that lie beside their pixels cost. */
std::vector<Table> shift_tables (
    const std::vector<Scene> &scenes, const Progress &progress);

/** The mean over the first 8 slots of @p scenes, coded frame by coded frame,
 * beside the figures of an independent calculation. */
Table comparison_table (const std::vector<Scene> &scenes);

/** Mean grey and entropy of the ranks of a staircase, the first frame of each
 * scene standing still. */
Table still_table (const std::vector<Scene> &scenes);

/** Light that a code lets through, and the signal to noise ratio of its
 * subframes on a flat grey at the same light. */
Table light_table ();

} // namespace cexp::quality

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The tables of docs/two-cameras.md. */
#pragma once

#include <vector>

#include "figures.h"
#include "fusion.h"
#include "table.h"

namespace codedexposure::quality
{

/** Of the largest value of a second camera, which white does not saturate. */
constexpr double kWhiteOfSecond = 0.95;

/** Beside @p first. */
Condition second_camera (const Condition &first, int slots);

/** Around mirrors that a camera of another view does not see, there is one
 * camera, px. */
constexpr int kWideBorder = 24;

/** With its own view, which its mapping has: a mirror image, turned by half a
 * degree, 1 % larger and shifted by (0.3, 0.4) px, behind a lens that blurs by
 * 0.3 px; by default seen from the front. */
Condition of_own_view (
    Condition second, double stretch = 1.0, double keystone = 0.0);

/** Mean PSNR over the frames of coded frames, without a border of 8 px, with
 * one camera and with a second one in the other beam. */
struct BeamGain {
  double one = 0.0, two = 0.0;
};

/** Of the first 8 frames of @p scene.
 *  @p partner  the second camera; what it is worse by is not known to the
 *              fusion, but by its mapping, if it has one.
 *  @p border   in place of 8 px. */
BeamGain beam_gain (const Scene &scene, int n, FuseQuality quality,
    const Condition &condition, const Condition &partner, int border = 8);

/** The gain of every quality, on every scene and in the mean. */
std::vector<Table> partner_tables (
    const std::vector<Scene> &scenes, const Progress &progress);

/** What is left of the gain of `fast` with errors of the second camera, and a
 * lens that both have. */
Table partner_error_table (
    const std::vector<Scene> &scenes, const Progress &progress);

/** `fast` with a second camera that is turned, mirrored and seen aslant. */
Table partner_view_table (
    const std::vector<Scene> &scenes, const Progress &progress);

/** `fast` where the first camera is saturated and the second one, behind a grey
 * filter, is not (FuseOptions::range). */
Table partner_range_table (
    const std::vector<Scene> &scenes, const Progress &progress);

} // namespace codedexposure::quality

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What pictures of an even light say of the camera and of the target. */
#pragma once

#include "doctor/checks.h"
#include "doctor/stack.h"

namespace codedexposure
{

/**
 * Measures and judges in @p finding what the frames of one mask show, whatever
 * the camera says of itself: "colour" (pixels of a 2x2 mosaic get different
 * light), "noise-reduction" and "sharpening" (the noise of neighbours, or of
 * frames, is not independent), "moving" and "texture" (the light is not even,
 * and changes its place).
 *
 * @p frames: four or more, of the same mask, not saturated, in their order. @p
 * dark: their mean without light.
 */
void check_pictures (const std::vector<SeenFrame> &frames,
    const Image<float> &dark, int largest, Finding &finding);

/**
 * How much more two stacks of the same mask differ than their noise explains,
 * as the ratio of the squares, in what neighbouring pixels have in common. 1 if
 * nothing moved; not measured where pixels are full.
 */
Measured change_between (
    const Stack &a, const Stack &b, const Image<float> &dark);

/** The reading of that. */
inline constexpr const char *kChange = "change of the picture";

} // namespace codedexposure

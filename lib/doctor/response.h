/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Whether pixel values follow the light, whatever the camera says of itself. */
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "doctor/checks.h"
#include "doctor/statistics.h"

namespace codedexposure
{

/** Light and pixel values over those without light, in any units. */
struct ResponsePoint {
  double light = 0.0, value = 0.0;
};

/** What bends a response as @p points show it: "gamma" where values are a power
 * of the light, "nonlinear" where they are a parabola of it, else "lut". */
struct Bend {
  const char *id = "nonlinear";
  double gamma = 1.0; ///< of the best power
};
Bend bend_of (const std::vector<ResponsePoint> &points);

/**
 * Shows all mirrors on in a part of the frame period, in one half of that, and
 * in the other: wherever the exposure lies, the halves together have the light
 * of the whole. Blames "gamma", "nonlinear" or "lut" in @p finding if their
 * pixel values do not have that sum, "auto-gain" or "auto-exposure" if they
 * do not because the camera follows the light, and "test-image" if no pixel
 * value ever changes. Does nothing where there is too little light to tell.
 */
Result<void> check_response (Examination &examination, Finding &finding);

/**
 * By how much later the last row is exposed than the first one, s. None if @p
 * tiles do not tell.
 *
 * @p tiles: frames with mirrors on in each of some equal parts of the cycle, by
 * the starts of these. @p period: of the cycle, s.
 */
std::optional<Measured> row_delay (
    const std::map<double, std::vector<BorderLight>> &tiles, double period);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Written by tests/quality/uncertainty --fit --scenes 8 --seed 1001: fitted
 * to the errors in scenes that were drawn from photographs of the packages
 * that are listed there. */
#pragma once

#include "fuse/uncertainty.h"

namespace codedexposure::fuse
{

/** By quality: fast, balanced, best, learned. */
constexpr UncertaintyFactors kEstimated[] = {
    {-0.0729f, 0.1988f, 0.1818f, 0.2607f, 0.1271f, 0.4891f},
    {-0.3493f, 0.2722f, 0.1335f, 0.2465f, 0.1208f, 0.2588f},
    {-0.3524f, 0.2448f, 0.1375f, 0.2298f, 0.0925f, 0.1405f},
    {-0.3517f, 0.2392f, 0.1235f, 0.2169f, 0.0848f, 0.1454f},
};
/** With noise. */
constexpr UncertaintyFactors kMeasured[] = {
    {-0.5396f, 0.0043f, 0.1402f, 0.3183f, 0.0000f, 0.5485f},
    {-0.8083f, 0.1268f, 0.0769f, 0.2872f, 0.0000f, 0.3801f},
    {-0.5288f, -0.0401f, 0.0336f, 0.3331f, 0.0000f, 0.6010f},
    {-0.3413f, -0.0109f, 0.0644f, 0.2892f, 0.0000f, 0.4733f},
};

} // namespace codedexposure::fuse

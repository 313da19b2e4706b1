/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Written by tests/quality/uncertainty --fit --scenes 8 --seed 1001: fitted
 * to the errors in scenes that were drawn from photographs of the packages
 * that are listed there. */
#pragma once

#include "fuse/uncertainty.h"

namespace codedexposure::fuse
{

/** Of one camera and of two, by quality: fast, balanced, best. */
constexpr UncertaintyFactors kEstimated[2][3] = {
    {
        {-0.0639f, 0.1583f, 0.2053f, 0.2868f, 0.1280f, 0.4319f},
        {-0.3569f, 0.2332f, 0.1574f, 0.2715f, 0.1261f, 0.2568f},
        {-0.3862f, 0.2073f, 0.1681f, 0.2574f, 0.1068f, 0.1819f},
    },
    {
        {0.0982f, 0.2191f, 0.2323f, 0.1700f, 0.2119f, 0.3332f},
        {-0.2525f, 0.3034f, 0.2053f, 0.1344f, 0.1894f, 0.2027f},
        {-0.2563f, 0.2732f, 0.2268f, 0.1206f, 0.1867f, 0.1718f},
    },
};
/** With noise. */
constexpr UncertaintyFactors kMeasured[2][3] = {
    {
        {-0.9245f, 0.0107f, 0.1536f, 0.3659f, 0.0000f, 0.5016f},
        {-1.1931f, 0.1323f, 0.0930f, 0.3245f, 0.0000f, 0.3512f},
        {-1.0816f, 0.0097f, 0.0799f, 0.3606f, 0.0000f, 0.4924f},
    },
    {
        {-1.0156f, 0.0760f, 0.1210f, 0.2829f, 0.0000f, 0.3992f},
        {-1.2933f, 0.1678f, 0.1365f, 0.2171f, 0.0000f, 0.2418f},
        {-1.1904f, 0.0539f, 0.1261f, 0.2518f, 0.0000f, 0.3938f},
    },
};
/** Times what the network of the refinement says of measured pixels with noise:
 * it learned from places that were fused worse than most. */
constexpr float kRefinedMeasured = 0.8374f;

} // namespace codedexposure::fuse

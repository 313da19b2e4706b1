/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Written by tests/quality/uncertainty --fit --scenes 8 --seed 1001: fitted
 * to the errors in scenes that were drawn from photographs of the packages
 * that are listed there. */
#pragma once

#include "fuse/uncertainty.h"

namespace codedexposure::fuse
{

/** By quality: fast, balanced, best. */
constexpr UncertaintyFactors kEstimated[] = {
    {-0.0639f, 0.1583f, 0.2053f, 0.2868f, 0.1280f, 0.4319f},
    {-0.3569f, 0.2332f, 0.1574f, 0.2715f, 0.1261f, 0.2568f},
    {-0.3862f, 0.2073f, 0.1681f, 0.2574f, 0.1068f, 0.1819f},
};
/** With noise. */
constexpr UncertaintyFactors kMeasured[] = {
    {-0.9245f, 0.0107f, 0.1536f, 0.3659f, 0.0000f, 0.5016f},
    {-1.1931f, 0.1323f, 0.0930f, 0.3245f, 0.0000f, 0.3512f},
    {-1.0816f, 0.0097f, 0.0799f, 0.3606f, 0.0000f, 0.4924f},
};
/** Times what the network of the refinement says of measured pixels with noise:
 * it learned from places that were fused worse than most. */
constexpr float kRefinedMeasured = 0.8374f;

} // namespace codedexposure::fuse

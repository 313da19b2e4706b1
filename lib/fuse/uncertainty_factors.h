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
    {-0.0785f, 0.2436f, 0.1618f, 0.2247f, 0.1222f, 0.3884f},
    {-0.2698f, 0.2281f, 0.1417f, 0.2763f, 0.1080f, 0.2384f},
    {-0.2736f, 0.2314f, 0.1416f, 0.2302f, 0.0904f, 0.1143f},
    {-0.2924f, 0.2287f, 0.1301f, 0.2213f, 0.0845f, 0.1061f},
};
/** With noise. */
constexpr UncertaintyFactors kMeasured[] = {
    {-0.6001f, 0.0574f, 0.1211f, 0.2856f, 0.0000f, 0.5299f},
    {-0.7970f, 0.1348f, 0.0600f, 0.2995f, 0.0000f, 0.3738f},
    {-0.5384f, -0.0241f, 0.0210f, 0.3425f, 0.0000f, 0.5934f},
    {-0.3887f, -0.0360f, 0.0834f, 0.3199f, 0.0000f, 0.5460f},
};

} // namespace codedexposure::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of one instruction set, compiled once for each. */
#include "fuse/convolve_kernel.h"
#include "fuse/filter_kernel.h"
#include "fuse/parts_kernel.h"
#include "fuse/rows_kernel.h"
#include "fuse/shrink_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

extern const fuse::Kernels kernels;
const fuse::Kernels kernels = {CODEDEXPOSURE_TARGET_NAME, filter_squared,
    filter_add, split_parts<std::int32_t>, split_parts<float>, join, sum, max,
    blur, compare, rate, fade_ratio, prefer, share, sum_blocks, weigh, to_steps,
    pair, to_pixels<std::uint8_t>, to_pixels<std::uint16_t>, shrink, settle,
    miss, move, convolve};

} // namespace codedexposure::CODEDEXPOSURE_TARGET

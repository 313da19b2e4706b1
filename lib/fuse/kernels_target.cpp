/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of one instruction set, compiled once for each. */
#include "fuse/filter_kernel.h"
#include "fuse/rows_kernel.h"
#include "fuse/shrink_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

extern const fuse::Kernels kernels;
const fuse::Kernels kernels = {
    CODEDEXPOSURE_TARGET_NAME, filter, filter_add, sum, max, shrink};

} // namespace codedexposure::CODEDEXPOSURE_TARGET

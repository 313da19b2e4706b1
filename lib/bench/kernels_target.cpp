/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of one instruction set, compiled once for each. */
#include "bench/noise_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

extern const bench::Kernels kernels;
const bench::Kernels kernels = {CODEDEXPOSURE_TARGET_NAME, expose};

} // namespace codedexposure::CODEDEXPOSURE_TARGET

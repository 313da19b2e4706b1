/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of one instruction set, compiled once for each. */
#include "rectify/row_kernel.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

extern const rectify::Kernels kernels;
const rectify::Kernels kernels = {CODEDEXPOSURE_TARGET_NAME, measure_row,
    measure_row, {rectify_row<5>, rectify_row<7>, rectify_row<9>},
    {rectify_row<5>, rectify_row<7>, rectify_row<9>}};

} // namespace codedexposure::CODEDEXPOSURE_TARGET

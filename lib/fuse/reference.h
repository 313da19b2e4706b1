/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels value by value: slow and readable. All others must give the same
 * bits. */
#pragma once

#include "fuse/kernels.h"

namespace codedexposure::fuse
{

void reference_filter (const FilterRow &row, float *const *outputs);
void reference_filter_add (
    const FilterRow &row, const float *scale, float *const *outputs);
void reference_sum (
    const float *const *rows, int rows_count, int count, float *to);
void reference_max (
    const float *const *rows, int rows_count, int count, float *to);
void reference_shrink (const ShrinkRow &row);

} // namespace codedexposure::fuse

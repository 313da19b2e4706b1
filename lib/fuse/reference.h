/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels number by number: slow, readable, and the truth that the others
 * must equal bit for bit. */
#pragma once

#include "fuse/kernels.h"

namespace cexp::fuse
{

void reference_filter (const FilterRow &row, float *const *outputs);
void reference_filter_add (
    const FilterRow &row, const float *scale, float *const *outputs);
void reference_sum (
    const float *const *rows, int rows_count, int count, float *to);
void reference_most (
    const float *const *rows, int rows_count, int count, float *to);
void reference_shrink (const ShrinkRow &row);

} // namespace cexp::fuse

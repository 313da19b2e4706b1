/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of one instruction set, compiled once for each. */
#include "base/vector.h"
#include "extract/combine.h"
#include "extract/kernels.h"
#include "extract/select.h"
#include "extract/sort.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

template <typename T>
constexpr Kernels<T> kKernels = {kLanes<T>, select<T>, rank<T>, difference<T>,
    lerp_difference<T>, decode<T>, count<T>, fence};

extern const Kernels<std::uint8_t> *const kernels_u8 = &kKernels<std::uint8_t>;
extern const Kernels<std::uint16_t> *const kernels_u16 =
    &kKernels<std::uint16_t>;

} // namespace codedexposure::CODEDEXPOSURE_TARGET

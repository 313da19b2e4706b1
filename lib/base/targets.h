/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The instruction sets that kernels are compiled for. */
#pragma once

#include <string_view>

namespace codedexposure
{

/**
 * Whether this processor can run a target of lib/meson.build: "avx512" (as in
 * Ice Lake and Zen 4), "avx2", "sse4", or "baseline", which all of them can.
 */
bool runs_target (std::string_view name);

} // namespace codedexposure

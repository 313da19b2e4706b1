/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The instruction sets that kernels are compiled for. */
#pragma once

#include <initializer_list>
#include <string_view>
#include <vector>

/** DO (target) for the instruction sets of a room in lib/meson.build, widest
 * first; its kernels are in the namespace ROOM_target.
 * @p narrow  the narrowest one on x86-64. */
#if defined __x86_64__
#define CODEDEXPOSURE_TARGETS(DO, narrow) DO (avx512) DO (avx2) DO (narrow)
#else
#define CODEDEXPOSURE_TARGETS(DO, narrow) DO (baseline)
#endif

namespace codedexposure
{

/**
 * Whether this processor can run a target of lib/meson.build: "avx512" (as in
 * Ice Lake and Zen 4), "avx2", "sse4", or "baseline", which all of them can.
 */
bool runs_target (std::string_view name);

/** Those of @p all, which have a name, that this processor can run. */
template <typename Kernels>
std::vector<Kernels>
supported (std::initializer_list<const Kernels *> all)
{
  std::vector<Kernels> found;
  for (const Kernels *kernels : all)
    if (runs_target (kernels->name))
      found.push_back (*kernels);
  return found;
}

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The instruction sets that kernels are compiled for. */
#pragma once

#include <initializer_list>
#include <span>
#include <string_view>
#include <vector>

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

/** DO (room, Kernels, target) for the instruction sets of a room in
 * lib/meson.build, widest first. @p narrow: the narrowest one on x86-64. */
#if defined __x86_64__
#define CODEDEXPOSURE_TARGETS(DO, room, Kernels, narrow)                       \
  DO (room, Kernels, avx512)                                                   \
  DO (room, Kernels, avx2) DO (room, Kernels, narrow)
#else
#define CODEDEXPOSURE_TARGETS(DO, room, Kernels, narrow)                       \
  DO (room, Kernels, baseline)
#endif
#define CODEDEXPOSURE_DECLARE(room, Kernels, target)                           \
  namespace room##_##target                                                    \
  {                                                                            \
    extern const Kernels kernels;                                              \
  }
#define CODEDEXPOSURE_ADDRESS(room, Kernels, target) &room##_##target::kernels,

/** In namespace codedexposure, the definition of @p function, which gives the
 * kernels of @p room that this processor can run, widest first. */
#define CODEDEXPOSURE_SUPPORTED(function, room, Kernels, narrow)               \
  CODEDEXPOSURE_TARGETS (CODEDEXPOSURE_DECLARE, room, Kernels, narrow)         \
  std::span<const Kernels> function ()                                         \
  {                                                                            \
    static const auto found = supported<Kernels> ({CODEDEXPOSURE_TARGETS (     \
        CODEDEXPOSURE_ADDRESS, room, Kernels, narrow)});                       \
    return found;                                                              \
  }

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/targets.h"

#include <vector>

#define CODEDEXPOSURE_DECLARE(target)                                          \
  namespace codedexposure::target                                              \
  {                                                                            \
  extern const Kernels<std::uint8_t> *const kernels_u8;                        \
  extern const Kernels<std::uint16_t> *const kernels_u16;                      \
  }
#define CODEDEXPOSURE_TARGET_ENTRY(target)                                     \
  {                                                                            \
#target, target::kernels_u8, target::kernels_u16                           \
  }

#if defined __x86_64__
CODEDEXPOSURE_DECLARE (avx512)
CODEDEXPOSURE_DECLARE (avx512vl)
CODEDEXPOSURE_DECLARE (avx2)
CODEDEXPOSURE_DECLARE (sse4)
#endif
CODEDEXPOSURE_DECLARE (baseline)

namespace codedexposure
{

namespace
{

std::vector<Target>
find_targets ()
{
  std::vector<Target> targets;
#if defined __x86_64__
  if (__builtin_cpu_supports ("avx512f") &&
      __builtin_cpu_supports ("avx512bw") &&
      __builtin_cpu_supports ("avx512dq") &&
      __builtin_cpu_supports ("avx512vl") &&
      __builtin_cpu_supports ("avx512vbmi"))
    targets.insert (targets.end (), {CODEDEXPOSURE_TARGET_ENTRY (avx512),
                                        CODEDEXPOSURE_TARGET_ENTRY (avx512vl)});
  if (__builtin_cpu_supports ("avx2"))
    targets.push_back (CODEDEXPOSURE_TARGET_ENTRY (avx2));
  if (__builtin_cpu_supports ("sse4.1") && __builtin_cpu_supports ("ssse3"))
    targets.push_back (CODEDEXPOSURE_TARGET_ENTRY (sse4));
#endif
  targets.push_back (CODEDEXPOSURE_TARGET_ENTRY (baseline));
  return targets;
}

} // namespace

std::span<const Target>
supported_targets ()
{
  static const std::vector<Target> targets = find_targets ();
  return targets;
}

} // namespace codedexposure

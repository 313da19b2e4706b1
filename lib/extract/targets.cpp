/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/targets.h"

#include <vector>

#include "base/targets.h"

/* Plain x86-64 cannot permute bytes: the reference is as fast there. */
#if defined __x86_64__
#define CODEDEXPOSURE_TARGETS(DO) DO (avx512) DO (avx2) DO (sse4)
#else
#define CODEDEXPOSURE_TARGETS(DO) DO (baseline)
#endif

#define CODEDEXPOSURE_DECLARE(target)                                          \
  namespace codedexposure::extract_##target                                    \
  {                                                                            \
    extern const Kernels<std::uint8_t> *const kernels_u8;                      \
    extern const Kernels<std::uint16_t> *const kernels_u16;                    \
  }
CODEDEXPOSURE_TARGETS (CODEDEXPOSURE_DECLARE)

namespace codedexposure
{

static std::vector<Target>
find_targets ()
{
  std::vector<Target> targets;
#define CODEDEXPOSURE_FIND(target)                                             \
  if (runs_target (#target))                                                   \
    targets.push_back ({#target, extract_##target::kernels_u8,                 \
        extract_##target::kernels_u16});
  CODEDEXPOSURE_TARGETS (CODEDEXPOSURE_FIND)
  return targets;
}

std::span<const Target>
supported_targets ()
{
  static const std::vector<Target> targets = find_targets ();
  return targets;
}

} // namespace codedexposure

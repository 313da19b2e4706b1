/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/kernels.h"

#include <vector>

#include "base/targets.h"

#if defined __x86_64__
#define CODEDEXPOSURE_TARGETS(DO) DO (avx512) DO (avx2) DO (baseline)
#else
#define CODEDEXPOSURE_TARGETS(DO) DO (baseline)
#endif

#define CODEDEXPOSURE_DECLARE(target)                                          \
  namespace codedexposure::fuse_##target                                       \
  {                                                                            \
    extern const fuse::Kernels kernels;                                        \
  }
CODEDEXPOSURE_TARGETS (CODEDEXPOSURE_DECLARE)

namespace codedexposure::fuse
{

static std::vector<Kernels>
find_kernels ()
{
  std::vector<Kernels> found;
#define CODEDEXPOSURE_FIND(target)                                             \
  if (runs_target (#target))                                                   \
    found.push_back (fuse_##target::kernels);
  CODEDEXPOSURE_TARGETS (CODEDEXPOSURE_FIND)
  return found;
}

std::span<const Kernels>
supported_kernels ()
{
  static const std::vector<Kernels> kernels = find_kernels ();
  return kernels;
}

} // namespace codedexposure::fuse

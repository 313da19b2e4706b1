/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/kernels.h"

#include <vector>

#define CODEDEXPOSURE_DECLARE(target)                                          \
  namespace codedexposure::target                                              \
  {                                                                            \
  extern const fuse::Kernels kernels;                                          \
  }

#if defined __x86_64__
CODEDEXPOSURE_DECLARE (fuse_avx512vnni)
CODEDEXPOSURE_DECLARE (fuse_avx512)
CODEDEXPOSURE_DECLARE (fuse_avx2)
#endif
CODEDEXPOSURE_DECLARE (fuse_baseline)

namespace codedexposure::fuse
{

static std::vector<Kernels>
find_kernels ()
{
  std::vector<Kernels> found;
#if defined __x86_64__
  const bool wide = __builtin_cpu_supports ("avx512f") &&
                    __builtin_cpu_supports ("avx512dq") &&
                    __builtin_cpu_supports ("avx512bw");
  if (wide && __builtin_cpu_supports ("avx512vnni"))
    found.push_back (fuse_avx512vnni::kernels);
  if (wide)
    found.push_back (fuse_avx512::kernels);
  if (__builtin_cpu_supports ("avx2") && __builtin_cpu_supports ("fma"))
    found.push_back (fuse_avx2::kernels);
#endif
  found.push_back (fuse_baseline::kernels);
  return found;
}

std::span<const Kernels>
supported_kernels ()
{
  static const std::vector<Kernels> kernels = find_kernels ();
  return kernels;
}

} // namespace codedexposure::fuse

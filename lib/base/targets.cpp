/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/targets.h"

namespace codedexposure
{

bool
runs_target (std::string_view name)
{
#if defined __x86_64__
  if (name == "avx512")
    return __builtin_cpu_supports ("avx512f") &&
           __builtin_cpu_supports ("avx512bw") &&
           __builtin_cpu_supports ("avx512dq") &&
           __builtin_cpu_supports ("avx512vl") &&
           __builtin_cpu_supports ("avx512vbmi") &&
           __builtin_cpu_supports ("avx512vnni");
  if (name == "avx2")
    return __builtin_cpu_supports ("avx2") && __builtin_cpu_supports ("fma");
  if (name == "sse4")
    return __builtin_cpu_supports ("ssse3") &&
           __builtin_cpu_supports ("sse4.1");
#endif
  return name == "baseline";
}

} // namespace codedexposure

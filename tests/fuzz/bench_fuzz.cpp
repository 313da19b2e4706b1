/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Any bytes as the JSON form of a bench profile: what is accepted can be used
 * with any schedule. */
#include <cmath>

#include "fuzz_check.h"
#include "setup/bench_profile.h"

using namespace codedexposure;
using namespace codedexposure::test;

extern "C" int
LLVMFuzzerTestOneInput (const std::uint8_t *data, std::size_t size)
{
  const std::string_view text = text_of (data, size);
  const auto profile = BenchProfile::from_json (text);
  check_json (profile);
  if (!profile)
    return 0;
  require (profile->with_leak (Schedule ()).ok (), "the leak is refused", text);
  const double gain = profile->electrons_per_number ().value_or (1.0);
  require (std::isfinite (gain) && gain > 0.0, "no gain", text);
  check (profile->check_frames ({64, 48}, 8));
  check (profile->check_bench (*profile));
  if (const auto old = profile->why_doubtful (
          std::chrono::sys_days (std::chrono::days (20000))))
    check (Error{*old});
  return 0;
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Reads bench profiles from parsed JSON; for source files of lib/ only. */
#pragma once

#include "base/json.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** A number of a profile, and the range that it is in. */
struct BenchQuantity {
  std::optional<Measured> BenchProfile::*member;
  const char *key, *name, *unit;
  double low, high;
};
std::span<const BenchQuantity> bench_quantities ();

/** Throws Error. */
BenchProfile read_bench_profile (const Json &root);

} // namespace codedexposure

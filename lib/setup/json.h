/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Reads bench profiles from parsed JSON; for source files of lib/ only. */
#pragma once

#include "base/json.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** Throws Error. */
BenchProfile read_bench_profile (const Json &root);

} // namespace codedexposure

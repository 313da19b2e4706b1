/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Readers of JSON that was parsed already; for the sources of lib/ only. */
#pragma once

#include "base/json.h"
#include "mapping/mapping.h"
#include "schedule/schedule.h"

namespace codedexposure
{

Result<Schedule> read_schedule (const Json &root);
Result<Mapping> read_mapping (const Json &root);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Readers of JSON that was parsed already; for the sources of lib/ only. */
#pragma once

#include "schedule/mapping.h"
#include "schedule/schedule.h"
#include "schedule/strict_json.h"

namespace cexp
{

Result<Schedule> read_schedule (const Json &root);
Result<Mapping> read_mapping (const Json &root);

} // namespace cexp

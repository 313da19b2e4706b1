/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Reads schedules from parsed JSON; for source files of lib/ only. */
#pragma once

#include "base/json.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** @p more  keys that may stand beside those of a schedule. Throws Error. */
Schedule read_schedule (const Json &root, const JsonKeys &more = {});

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Reads mappings from parsed JSON; for source files of lib/ only. */
#pragma once

#include "base/json.h"
#include "mapping/mapping.h"

namespace codedexposure
{

/** Throws Error. */
Mapping read_mapping (const Json &root);

} // namespace codedexposure

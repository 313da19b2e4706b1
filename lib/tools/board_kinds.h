/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Boards by name, for use without the board. */
#pragma once

#include <string>

#include "base/result.h"
#include "dmd/dmd.h"

namespace codedexposure::tool
{

/** What a board of that name can do: dlp3000, dlp4500, dlp6500 or dlp9000. */
Result<DmdInfo> find_kind (const std::string &name);

} // namespace codedexposure::tool

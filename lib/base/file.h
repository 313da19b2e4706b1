/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Files that are read as a whole. */
#pragma once

#include <cstddef>
#include <string>

#include "base/result.h"

namespace cexp
{

/** Up to @p limit + 1 bytes of the file @p path, so that the caller can tell
 * when there are too many. The error says what failed, not of which file. */
Result<std::string> read_file (const std::string &path, std::size_t limit);

} // namespace cexp

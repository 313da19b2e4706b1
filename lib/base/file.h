/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Reads whole files. */
#pragma once

#include <cstddef>
#include <string>

#include "base/result.h"

namespace codedexposure
{

/** The first @p limit + 1 bytes of the file @p path: if there are more than @p
 * limit, it is too long. The error does not name the file; its code is
 * not_found or io. */
Result<std::string> read_file (const std::string &path, std::size_t limit);

} // namespace codedexposure

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Reads and writes whole files, and ends what was printed. */
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

/** Writes @p content to the file @p path, which gets its name when it is
 * complete; one that is there keeps its mode, and a link stays a link. The
 * error, "cannot be written to 'PATH': why", is to follow the name of what is
 * written. */
Result<void> write_file (const std::string &path, const std::string &content);

/** Writes what was printed to stdout and is still held. Error, also if an
 * earlier part of it was lost: it cannot be written. */
Result<void> finish_output ();

} // namespace codedexposure

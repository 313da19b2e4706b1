/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <string>
#include <vector>

namespace codedexposure::app
{

/** Becomes the Python program that drives archives, which runs this program
 * again by the path in CODEDEXPOSURE_PROGRAM. Throws Failure. */
[[noreturn]] void become_archive (const std::vector<std::string> &words);

} // namespace codedexposure::app

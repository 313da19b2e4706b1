/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <string>

#include "options/source.h"
#include "pipeline/status.h"

namespace codedexposure::app
{

/** "ffv1" if this machine encodes the frames of @p plan 1.5 times as fast as
 * they come, else "raw", which the disk of @p file is measured for; says why.
 * Takes some seconds. */
std::string choose_codec (
    const SourcePlan &plan, const std::string &file, Status &status);

/** Bytes/s that the disk of @p file takes, past the page cache where its file
 * system can, as raw recordings are written. Throws Failure. */
double disk_speed (const std::string &file);

} // namespace codedexposure::app

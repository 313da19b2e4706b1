/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <string>
#include <vector>

#include "stack_file.h"

namespace codedexposure::gst
{

/** The OME-XML (schema 2016-06) of pictures, one for each row, over time. Their
 * exact times and what OME has no word for are in annotations. */
std::string ome_xml (const StackFormat &format,
    const std::vector<StackRow> &rows, const std::vector<StackOrigin> &origins,
    const char *description);

} // namespace codedexposure::gst

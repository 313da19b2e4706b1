/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Scenes from files. */
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "scene.h"

namespace codedexposure::quality
{

/** The first @p frames luma frames of a video file, or all if it has fewer.
 * Needs gst_init (). Error if it does not exist or cannot be decoded. */
Result<Scene> read_video (const std::string &path, int frames);

/**
 * The clips of a folder with a manifest.json:
 * {"items": [{"name", "file", "width", "height", "frames"}, ...]}, each file
 * its 8-bit frames one after the other without headers.
 * @p frames  at most so many of each.
 */
Result<std::vector<Scene>> read_clips (const std::string &folder, int frames);

} // namespace codedexposure::quality

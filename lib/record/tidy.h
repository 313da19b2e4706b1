/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What GStreamer's muxer writes in a way that only GStreamer reads well. */
#pragma once

#include <string>

#include "base/result.h"

namespace codedexposure
{

/**
 * Rewrites a finished Matroska file of GStreamer's muxer for other programs. No
 * byte moves, so a program that is stopped in between leaves a valid file.
 *
 * - Texts of tags, which that muxer quotes and escapes, become plain.
 * - A text track is no longer the default, so players do not show its lines on
 *   the pictures unasked.
 *
 * Other files stay as they are. An error if @p path cannot be read or written.
 */
Result<void> tidy_matroska (const std::string &path);

} // namespace codedexposure

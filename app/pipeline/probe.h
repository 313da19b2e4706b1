/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <string>

#include "base/geometry.h"
#include "schedule/timing.h"

namespace codedexposure::app
{

/** Of a video file that becomes a scene. */
struct VideoFacts {
  Extent size;
  FrameRate rate{0, 1}; ///< 0: not fixed
};

/** Reads the head of the video file @p path. Throws Failure: it is none, or its
 * frames are coded, which is no scene. */
VideoFacts probe_video (const std::string &path);

} // namespace codedexposure::app

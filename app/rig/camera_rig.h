/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A DMD and a GenICam camera, for the checks of the bench. */
#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "doctor/rig.h"
#include "options/source.h"

namespace codedexposure::app
{

struct CameraRigOptions {
  /** Camera and DMD; `exposure` is the longest one, none: what a frame period
   * leaves. */
  SourceOptions source;
  SourcePlan plan;
  std::string recording = {}; ///< file that is written and removed
  /** Of a camera in the beam of the mirrors that are off; none: there is none.
   */
  std::optional<SourceOptions> second = {};
};

/** Takes @p dmd, which is open, and opens the camera; errors are those of the
 * camera. A request to @p stop ends every call with ErrorCode::cancelled. The
 * destructor parks the mirrors. */
Result<std::unique_ptr<Rig>> open_camera_rig (const CameraRigOptions &options,
    std::unique_ptr<Dmd> dmd, std::stop_token stop);

} // namespace codedexposure::app

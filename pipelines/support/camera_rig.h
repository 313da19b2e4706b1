/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A DMD and a GenICam camera, for the checks of the bench. */
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "doctor/rig.h"

struct CameraRigOptions {
  std::string camera; ///< as codedexposure-camerasrc camera-name
  std::string device; ///< of the DMD, as open_dmd () takes it
  codedexposure::FrameRate rate;
  /** Properties of codedexposure-camerasrc beyond these, "a=b c=d". */
  std::string properties;
  /** Longest exposure time; none: what a frame period leaves. */
  std::optional<codedexposure::Nanoseconds> exposure;
};

/** Takes @p dmd, which is open, and opens the camera; errors are those of the
 * camera. A request to @p stop ends every call with ErrorCode::cancelled. The
 * destructor parks the mirrors. */
codedexposure::Result<std::unique_ptr<codedexposure::Rig>> open_camera_rig (
    const CameraRigOptions &options, std::unique_ptr<codedexposure::Dmd> dmd,
    std::stop_token stop);

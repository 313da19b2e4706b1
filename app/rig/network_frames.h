/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames of a camera as the network delivers them. */
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include <glib.h>

#include "doctor/rig.h"

namespace codedexposure::app
{

/** Of Aravis; @p error is freed. */
Error camera_error (GError *error);

struct StreamRequest {
  std::string camera;   ///< as Aravis names it; nobody has it open
  std::string features; ///< to set before, "A=1 B=2"
  Nanoseconds exposure = 0;
  /** Starts the trigger, when the camera is set up. */
  std::function<Result<void> ()> begin;
  int frames = 0;
  Nanoseconds patience = 0; ///< ends early after that much silence
  std::stop_token stop = {};
};

/** Whole and damaged frames in the order in which they came, without pictures.
 * Error cancelled after a request to stop. */
Result<std::vector<SeenFrame>> receive_frames (const StreamRequest &request);

} // namespace codedexposure::app

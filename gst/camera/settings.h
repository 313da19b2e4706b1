/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties of a camera, and the GenICam features that follow from them. */
#pragma once

#include <string>

#include "base/result.h"
#include "common/named.h"
#include "setup/bench_profile.h"

namespace codedexposure::gst::camera
{

/** Which device starts an exposure. */
enum class Trigger { none, dmd, camera };
enum class Edge { rising, falling };

struct Settings {
  std::string name;         ///< as Aravis lists it; empty: the first one
  std::string pixel_format; ///< GenICam name; empty: as the caps say
  Trigger trigger = Trigger::none;
  std::string trigger_line; ///< empty: Line0 for an input, Line1 for an output
  Edge trigger_edge = Edge::rising;
  double exposure_time = 0; ///< microseconds; 0: as the camera has it
  std::string features;     ///< assignments beyond these
  int num_buffers = -1;     ///< frames until EOS; -1: no end
  unsigned reconnect = 0;   ///< tries to restart a camera that went away
  Named<BenchProfile> bench;
};

/** An error that names the value, the rule and the remedy. */
Result<void> check_settings (const Settings &settings);

/**
 * Assignments in the order that a camera needs: a selector before what it
 * selects, and the user's own last. Aravis makes them after it has set the
 * frame rate, which ends all triggers.
 *
 * @p settings  checked.
 */
std::string feature_assignments (const Settings &settings);

/** Caps of the frames that come with a pixel format. */
std::string caps_of_format (const std::string &pixel_format);

} // namespace codedexposure::gst::camera

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What GenICam cameras say of themselves. */
#pragma once

#include <optional>
#include <string>

#include <gst/gst.h>

#include "base/result.h"

struct _ArvDevice; // of Aravis, which not every build has

namespace codedexposure::app
{

/** Which cameras answer, or that none does, for a message. Takes a second. */
std::string cameras_found ();

/** The text of a feature of @p camera; none: it lacks that. */
std::optional<std::string> feature_text (_ArvDevice *camera, const char *name);

/** Both are included. */
struct Between {
  double low = 0, high = 0;
};

/** Changes the gain of the camera of @p camerasrc by @p steps twentieths of its
 * range. "gain 3.5 (0 to 24)", as the camera says it. Error: it cannot, or a
 * bench profile was measured at the gain that it has. */
Result<std::string> change_gain (GstElement *camerasrc, int steps);

/** The same for the exposure time, within what the schedule allows: @p allowed,
 * us. */
Result<std::string> change_exposure (
    GstElement *camerasrc, int steps, Between allowed);

} // namespace codedexposure::app

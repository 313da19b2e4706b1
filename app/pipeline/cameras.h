/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What GenICam cameras say of themselves. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>

namespace codedexposure::app
{

/** The names of all cameras that answer. Takes a second. */
std::vector<std::string> camera_names ();

/** The same for a message: which there are, or that there is none. */
std::string cameras_found ();

/** For how long the camera of @p camerasrc exposes, us; none: it does not say.
 */
std::optional<double> camera_exposure (GstElement *camerasrc);

} // namespace codedexposure::app

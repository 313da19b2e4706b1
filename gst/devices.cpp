/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A plugin of its own: what only decodes does not load the libraries of cameras
 * and of drawing. */
#include "parts.h"

GST_PLUGIN_DEFINE (GST_VERSION_MAJOR, GST_VERSION_MINOR, codedexposuredevices,
    "Per-pixel coded exposure: cameras, and their calibration to the DMD",
    codedexposure::gst::register_devices, PACKAGE_VERSION, "LGPL", PACKAGE,
    "Unknown package origin")

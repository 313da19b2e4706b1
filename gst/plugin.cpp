/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The plugin: registers its elements, nothing else. */
#include "parts.h"

GST_PLUGIN_DEFINE (GST_VERSION_MAJOR, GST_VERSION_MINOR, codedexposure,
    "Per-pixel coded exposure: a fast camera from a slow one and a DMD",
    codedexposure::gst::register_elements, PACKAGE_VERSION, "LGPL", PACKAGE,
    "Unknown package origin")

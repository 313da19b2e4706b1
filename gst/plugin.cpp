/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The plugin: registers its elements, nothing else. */
#include "parts.h"

static gboolean
plugin_init (GstPlugin *plugin)
{
  return codedexposure::gst::register_elements (plugin);
}

GST_PLUGIN_DEFINE (GST_VERSION_MAJOR, GST_VERSION_MINOR, codedexposure,
    "Per-pixel coded exposure: a fast camera from a slow one and a DMD",
    plugin_init, PACKAGE_VERSION, "LGPL", PACKAGE, "Unknown package origin")

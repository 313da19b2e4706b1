/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the plugins register; with NULL, what is linked into a program. */
#pragma once

#include <gst/gst.h>

namespace codedexposure::gst
{

/** What records, decodes, simulates and shows. */
gboolean register_elements (GstPlugin *plugin);

/** What register_elements () adds for everybody but the demo. */
gboolean register_more_elements (GstPlugin *plugin);

/** Cameras and their calibration. */
gboolean register_devices (GstPlugin *plugin);

} // namespace codedexposure::gst

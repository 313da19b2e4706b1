/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The beams of the mirrors, as a property. */
#pragma once

#include <glib-object.h>

namespace codedexposure::gst
{

/** The beam of the mirrors in which a camera is. */
enum class Beam { kOn, kOff };

GType gst_coded_exposure_beam_get_type ();

} // namespace codedexposure::gst

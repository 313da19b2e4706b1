/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "common/beam.h"

#include <gst/gst.h>

namespace codedexposure::gst
{

G_DEFINE_ENUM_TYPE (GstCodedExposureBeam, gst_coded_exposure_beam,
    {int (Beam::kOn), "The mirrors that are on", "on"},
    {int (Beam::kOff), "The mirrors that are off, as a second camera sees them",
        "off"})

} // namespace codedexposure::gst

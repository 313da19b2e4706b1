/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: one coded frame in, n timed subframes out. */
#pragma once

#include <gst/gst.h>

G_BEGIN_DECLS

#define GST_TYPE_CODED_EXPOSURE_DEMUX (gst_coded_exposure_demux_get_type ())
G_DECLARE_FINAL_TYPE (GstCodedExposureDemux, gst_coded_exposure_demux, GST,
    CODED_EXPOSURE_DEMUX, GstElement)

GST_ELEMENT_REGISTER_DECLARE (codedexposure_demux);

G_END_DECLS

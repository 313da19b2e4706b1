/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-sim: an optical bench in software, video in, coded frames out.
 */
#pragma once

#include <gst/gst.h>
#include <gst/video/gstvideofilter.h>

G_BEGIN_DECLS

#define GST_TYPE_CODED_EXPOSURE_SIM (gst_coded_exposure_sim_get_type ())
G_DECLARE_FINAL_TYPE (GstCodedExposureSim, gst_coded_exposure_sim, GST,
    CODED_EXPOSURE_SIM, GstVideoFilter)

GST_ELEMENT_REGISTER_DECLARE (codedexposure_sim);

G_END_DECLS

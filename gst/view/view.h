/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-view: pictures of any depth, to look at. */
#pragma once

#include <gst/gst.h>
#include <gst/video/gstvideofilter.h>

G_BEGIN_DECLS

#define GST_TYPE_CODED_EXPOSURE_VIEW (gst_coded_exposure_view_get_type ())
G_DECLARE_FINAL_TYPE (GstCodedExposureView, gst_coded_exposure_view, GST,
    CODED_EXPOSURE_VIEW, GstVideoFilter)

GST_ELEMENT_REGISTER_DECLARE (codedexposure_view);

G_END_DECLS

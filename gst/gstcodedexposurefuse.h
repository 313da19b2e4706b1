/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-fuse: one coded frame in, n full-resolution frames out. */
#pragma once

#include <gst/gst.h>

G_BEGIN_DECLS

#define GST_TYPE_CODED_EXPOSURE_FUSE (gst_coded_exposure_fuse_get_type ())
G_DECLARE_FINAL_TYPE (GstCodedExposureFuse, gst_coded_exposure_fuse, GST,
    CODED_EXPOSURE_FUSE, GstElement)

GST_ELEMENT_REGISTER_DECLARE (codedexposure_fuse);

G_END_DECLS

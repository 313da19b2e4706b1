/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-camerasrc: frames of a GenICam camera. */
#pragma once

#include <gst/gst.h>

G_BEGIN_DECLS

#define GST_TYPE_CODED_EXPOSURE_CAMERA_SRC                                     \
  (gst_coded_exposure_camera_src_get_type ())
G_DECLARE_FINAL_TYPE (GstCodedExposureCameraSrc, gst_coded_exposure_camera_src,
    GST, CODED_EXPOSURE_CAMERA_SRC, GstBin)

GST_ELEMENT_REGISTER_DECLARE (codedexposure_camerasrc);

G_END_DECLS

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Lists GenICam cameras as devices of codedexposure-camerasrc. */
#pragma once

#include <gst/gst.h>

G_BEGIN_DECLS

#define GST_TYPE_CODED_EXPOSURE_CAMERA_PROVIDER                                \
  (gst_coded_exposure_camera_provider_get_type ())
G_DECLARE_FINAL_TYPE (GstCodedExposureCameraProvider,
    gst_coded_exposure_camera_provider, GST, CODED_EXPOSURE_CAMERA_PROVIDER,
    GstDeviceProvider)

GST_DEVICE_PROVIDER_REGISTER_DECLARE (codedexposure_cameraprovider);

G_END_DECLS

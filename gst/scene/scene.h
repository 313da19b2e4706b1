/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-scene: drawn scenes that move fast. */
#pragma once

#include <gst/base/gstpushsrc.h>
#include <gst/gst.h>

G_BEGIN_DECLS

#define GST_TYPE_CODED_EXPOSURE_SCENE (gst_coded_exposure_scene_get_type ())
G_DECLARE_FINAL_TYPE (GstCodedExposureScene, gst_coded_exposure_scene, GST,
    CODED_EXPOSURE_SCENE, GstPushSrc)

#define GST_TYPE_CODED_EXPOSURE_SCENE_KIND                                     \
  (gst_coded_exposure_scene_kind_get_type ())
GType gst_coded_exposure_scene_kind_get_type ();

GST_ELEMENT_REGISTER_DECLARE (codedexposure_scene);

G_END_DECLS

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-log: what is known of every coded frame, to a file beside the
 * recording. */
#pragma once

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>

G_BEGIN_DECLS

#define GST_TYPE_CODED_EXPOSURE_LOG (gst_coded_exposure_log_get_type ())
G_DECLARE_FINAL_TYPE (GstCodedExposureLog, gst_coded_exposure_log, GST,
    CODED_EXPOSURE_LOG, GstBaseTransform)

GST_ELEMENT_REGISTER_DECLARE (codedexposure_log);

G_END_DECLS

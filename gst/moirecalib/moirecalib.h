/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* moirecalib: where the camera stands against the mirrors, live. */
#pragma once

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>

G_BEGIN_DECLS

#define GST_TYPE_MOIRE_CALIB (gst_moire_calib_get_type ())
G_DECLARE_FINAL_TYPE (
    GstMoireCalib, gst_moire_calib, GST, MOIRE_CALIB, GstBaseTransform)

GST_ELEMENT_REGISTER_DECLARE (moirecalib);

G_END_DECLS

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync: drives the DMD, and makes time and phase of coded frames known. */
#pragma once

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>

G_BEGIN_DECLS

#define GST_TYPE_DMD_SYNC (gst_dmd_sync_get_type ())
G_DECLARE_FINAL_TYPE (GstDmdSync, gst_dmd_sync, GST, DMD_SYNC, GstBaseTransform)

GST_ELEMENT_REGISTER_DECLARE (dmdsync);

G_END_DECLS

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Types of dmdsync's properties. */
#pragma once

#include <gst/gst.h>

#define GST_TYPE_DMD_SYNC_TIMESTAMP_AT (gst_dmd_sync_timestamp_at_get_type ())
GType gst_dmd_sync_timestamp_at_get_type ();

#define GST_TYPE_DMD_SYNC_ON_LOSS (gst_dmd_sync_on_loss_get_type ())
GType gst_dmd_sync_on_loss_get_type ();

#define GST_TYPE_DMD_SYNC_ON_UNLOCK (gst_dmd_sync_on_unlock_get_type ())
GType gst_dmd_sync_on_unlock_get_type ();

#define GST_TYPE_DMD_SYNC_SLIP_OBSERVABLE                                      \
  (gst_dmd_sync_slip_observable_get_type ())
GType gst_dmd_sync_slip_observable_get_type ();

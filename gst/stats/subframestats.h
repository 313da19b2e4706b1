/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* subframestats: intensity, entropy and line profile of every picture. */
#pragma once

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>

G_BEGIN_DECLS

#define GST_TYPE_SUBFRAME_STATS (gst_subframe_stats_get_type ())
G_DECLARE_FINAL_TYPE (
    GstSubframeStats, gst_subframe_stats, GST, SUBFRAME_STATS, GstBaseTransform)

#define GST_TYPE_SUBFRAME_STATS_FORMAT (gst_subframe_stats_format_get_type ())
GType gst_subframe_stats_format_get_type ();

GST_ELEMENT_REGISTER_DECLARE (subframestats);

G_END_DECLS

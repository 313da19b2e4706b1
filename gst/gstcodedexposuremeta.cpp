/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "gstcodedexposuremeta.h"

namespace cexp::gst
{

const char *const kFrameMetaName = "CodedExposureFrame";

/* A custom meta is copied by every element that copies {"video"} metas, also
 * through scalers and encoders in the same process. */
void
register_frame_meta ()
{
  static const gchar *tags[] = {"video", nullptr};
  if (!gst_meta_get_info (kFrameMetaName))
    gst_meta_register_custom (kFrameMetaName, tags, nullptr, nullptr, nullptr);
}

void
set_frame_meta (GstBuffer *buffer, const FrameMeta &meta)
{
  GstCustomMeta *custom = gst_buffer_get_custom_meta (buffer, kFrameMetaName);
  if (!custom)
    custom = gst_buffer_add_custom_meta (buffer, kFrameMetaName);
  gst_structure_set (gst_custom_meta_get_structure (custom), "frame",
      G_TYPE_UINT64, meta.frame, "subframe", G_TYPE_INT, meta.subframe,
      "exposure-start", G_TYPE_UINT64, meta.exposure_start, "exposure-duration",
      G_TYPE_UINT64, meta.exposure_duration, "locked", G_TYPE_BOOLEAN,
      meta.locked, "slip", G_TYPE_INT, meta.slip, "lost-before", G_TYPE_UINT64,
      meta.lost_before, "saturated", G_TYPE_UINT64, meta.saturated, nullptr);
}

std::optional<FrameMeta>
get_frame_meta (GstBuffer *buffer)
{
  GstCustomMeta *custom = gst_buffer_get_custom_meta (buffer, kFrameMetaName);
  if (!custom)
    return std::nullopt;

  FrameMeta meta;
  gst_structure_get (gst_custom_meta_get_structure (custom), "frame",
      G_TYPE_UINT64, &meta.frame, "subframe", G_TYPE_INT, &meta.subframe,
      "exposure-start", G_TYPE_UINT64, &meta.exposure_start,
      "exposure-duration", G_TYPE_UINT64, &meta.exposure_duration, "locked",
      G_TYPE_BOOLEAN, &meta.locked, "slip", G_TYPE_INT, &meta.slip,
      "lost-before", G_TYPE_UINT64, &meta.lost_before, "saturated",
      G_TYPE_UINT64, &meta.saturated, nullptr);
  return meta;
}

} // namespace cexp::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "gstcodedexposuremeta.h"

namespace cexp::gst
{

const char *const kFrameMetaName = "CodedExposureFrame";

namespace
{

GType
frame_meta_api ()
{
  static const GType api = gst_meta_get_info (kFrameMetaName)->api;
  return api;
}

GstCustomMeta *
find (GstBuffer *buffer)
{
  return reinterpret_cast<GstCustomMeta *> (
      gst_buffer_get_meta (buffer, frame_meta_api ()));
}

struct MetaCopy {
  GstBuffer *to;
  GstVideoInfo from_info, to_info;
  bool whole; ///< the picture is of all of the other
};

gboolean
copy_meta (GstBuffer *from, GstMeta **meta, gpointer user_data)
{
  auto &copy = *static_cast<MetaCopy *> (user_data);
  const GstMetaInfo *info = (*meta)->info;
  const bool is_there = info->api == frame_meta_api () && find (copy.to);
  if (is_there || !info->transform_func ||
      info->api == GST_VIDEO_META_API_TYPE ||
      info->api == GST_VIDEO_CROP_META_API_TYPE ||
      info->api == GST_PARENT_BUFFER_META_API_TYPE ||
      gst_meta_api_type_has_tag (
          info->api, g_quark_from_static_string (GST_META_TAG_MEMORY_STR)))
    return TRUE;
  if (gst_meta_api_type_has_tag (info->api,
          g_quark_from_static_string (GST_META_TAG_VIDEO_SIZE_STR))) {
    if (!copy.whole)
      return TRUE;
    GstVideoMetaTransform scale{&copy.from_info, &copy.to_info};
    info->transform_func (copy.to, *meta, from,
        gst_video_meta_transform_scale_get_quark (), &scale);
    return TRUE;
  }
  GstMetaTransformCopy whole{FALSE, 0, gsize (-1)};
  info->transform_func (copy.to, *meta, from, _gst_meta_transform_copy, &whole);
  return TRUE;
}

} // namespace

/* A custom meta is copied by every element that copies {"video"} metas, also
 * through scalers and encoders in the same process. */
void
register_frame_meta ()
{
  static const gchar *tags[] = {"video", nullptr};
  if (!gst_meta_get_info (kFrameMetaName))
    gst_meta_register_custom (kFrameMetaName, tags, nullptr, nullptr, nullptr);
}

namespace
{

/* Looked up once: a subframe takes a few microseconds, names a good part of
 * one. */
struct Names {
  const GQuark frame = g_quark_from_static_string ("frame");
  const GQuark subframe = g_quark_from_static_string ("subframe");
  const GQuark exposure_start = g_quark_from_static_string ("exposure-start");
  const GQuark exposure_duration =
      g_quark_from_static_string ("exposure-duration");
  const GQuark locked = g_quark_from_static_string ("locked");
  const GQuark slip = g_quark_from_static_string ("slip");
  const GQuark lost_before = g_quark_from_static_string ("lost-before");
  const GQuark time_uncertainty =
      g_quark_from_static_string ("time-uncertainty");
  const GQuark bits = g_quark_from_static_string ("bits");
  const GQuark saturated = g_quark_from_static_string ("saturated");
  const GQuark pattern = g_quark_from_static_string ("pattern");
};

constexpr gint kFields = 10; ///< that are always there: all but the pattern

const Names &
names ()
{
  static const Names quarks;
  return quarks;
}

/* A frame that is described anew has all fields, and making them again would
 * take several times as long. */
gboolean
rewrite_field (GQuark field, GValue *value, gpointer user_data)
{
  const auto &meta = *static_cast<const FrameMeta *> (user_data);
  const Names &name = names ();
  if (field == name.frame)
    g_value_set_uint64 (value, meta.frame);
  else if (field == name.subframe)
    g_value_set_int (value, meta.subframe);
  else if (field == name.exposure_start)
    g_value_set_uint64 (value, meta.exposure_start);
  else if (field == name.exposure_duration)
    g_value_set_uint64 (value, meta.exposure_duration);
  else if (field == name.locked)
    g_value_set_boolean (value, meta.locked);
  else if (field == name.slip)
    g_value_set_int (value, meta.slip);
  else if (field == name.lost_before)
    g_value_set_uint64 (value, meta.lost_before);
  else if (field == name.saturated)
    g_value_set_uint64 (value, meta.saturated);
  else if (field == name.bits)
    g_value_set_int (value, meta.bits);
  else if (field == name.time_uncertainty)
    g_value_set_uint64 (value, meta.time_uncertainty);
  return TRUE;
}

void
write_fields (GstStructure *structure, const FrameMeta &meta)
{
  const Names &name = names ();
  gst_structure_id_set (structure, name.frame, G_TYPE_UINT64, meta.frame,
      name.subframe, G_TYPE_INT, meta.subframe, name.exposure_start,
      G_TYPE_UINT64, meta.exposure_start, name.exposure_duration, G_TYPE_UINT64,
      meta.exposure_duration, name.locked, G_TYPE_BOOLEAN, meta.locked,
      name.slip, G_TYPE_INT, meta.slip, name.lost_before, G_TYPE_UINT64,
      meta.lost_before, name.saturated, G_TYPE_UINT64, meta.saturated,
      name.bits, G_TYPE_INT, meta.bits, name.time_uncertainty, G_TYPE_UINT64,
      meta.time_uncertainty, nullptr);
}

} // namespace

void
set_frame_meta (GstBuffer *buffer, const FrameMeta &meta)
{
  GstCustomMeta *custom = find (buffer);
  if (!custom)
    custom = gst_buffer_add_custom_meta (buffer, kFrameMetaName);
  GstStructure *structure = gst_custom_meta_get_structure (custom);
  const GQuark pattern = names ().pattern;
  if (gst_structure_id_has_field (structure, pattern))
    gst_structure_remove_field (structure, "pattern");
  if (gst_structure_n_fields (structure) == kFields)
    gst_structure_map_in_place (
        structure, rewrite_field, const_cast<FrameMeta *> (&meta));
  else
    write_fields (structure, meta);
  if (!meta.pattern.empty ())
    gst_structure_id_set (
        structure, pattern, G_TYPE_STRING, meta.pattern.c_str (), nullptr);
}

std::optional<FrameMeta>
get_frame_meta (GstBuffer *buffer)
{
  GstCustomMeta *custom = find (buffer);
  if (!custom)
    return std::nullopt;

  FrameMeta meta;
  const Names &name = names ();
  const GstStructure *structure = gst_custom_meta_get_structure (custom);
  if (const GValue *pattern =
          gst_structure_id_get_value (structure, name.pattern))
    meta.pattern =
        G_VALUE_HOLDS_STRING (pattern) ? g_value_get_string (pattern) : "";
  gst_structure_id_get (structure, name.frame, G_TYPE_UINT64, &meta.frame,
      name.subframe, G_TYPE_INT, &meta.subframe, name.exposure_start,
      G_TYPE_UINT64, &meta.exposure_start, name.exposure_duration,
      G_TYPE_UINT64, &meta.exposure_duration, name.locked, G_TYPE_BOOLEAN,
      &meta.locked, name.slip, G_TYPE_INT, &meta.slip, name.lost_before,
      G_TYPE_UINT64, &meta.lost_before, name.saturated, G_TYPE_UINT64,
      &meta.saturated, nullptr);
  gst_structure_id_get (structure, name.bits, G_TYPE_INT, &meta.bits, nullptr);
  gst_structure_id_get (structure, name.time_uncertainty, G_TYPE_UINT64,
      &meta.time_uncertainty, nullptr);
  return meta;
}

void
copy_metas (GstBuffer *from, const GstVideoInfo &from_info, GstBuffer *to,
    const GstVideoInfo &to_info)
{
  MetaCopy copy{to, from_info, to_info, true};
  gst_buffer_foreach_meta (from, copy_meta, &copy);
}

void
copy_metas_to_part (GstBuffer *from, GstBuffer *to)
{
  MetaCopy copy{to, {}, {}, false};
  gst_buffer_foreach_meta (from, copy_meta, &copy);
}

} // namespace cexp::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "meta.h"

#include <array>

namespace codedexposure::gst
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
const auto &
quarks ()
{
  static const auto all = std::apply (
      [] (const auto &...field) {
        return std::array{g_quark_from_static_string (field.name)...};
      },
      FrameMeta::fields ());
  return all;
}

GQuark
pattern_quark ()
{
  static const GQuark pattern = g_quark_from_static_string ("pattern");
  return pattern;
}

/* Calls @visit with the quark and the member of each field. */
template <typename Meta, typename Visit>
void
each_field (Meta &meta, Visit visit)
{
  std::apply (
      [&, quark = quarks ().begin ()] (const auto &...field) mutable {
        (visit (*quark++, meta.*field.member), ...);
      },
      FrameMeta::fields ());
}

/* A frame that is described anew has all fields, and making them again would
 * take several times as long. */
gboolean
rewrite_field (GQuark name, GValue *value, gpointer user_data)
{
  const auto &meta = *static_cast<const FrameMeta *> (user_data);
  each_field (meta, [&] (GQuark quark, const auto &member) {
    if (quark == name)
      set_value (value, member);
  });
  return TRUE;
}

} // namespace

void
set_frame_meta (GstBuffer *buffer, const FrameMeta &meta)
{
  GstCustomMeta *custom = find (buffer);
  if (!custom)
    custom = gst_buffer_add_custom_meta (buffer, kFrameMetaName);
  GstStructure *structure = gst_custom_meta_get_structure (custom);
  if (gst_structure_id_has_field (structure, pattern_quark ()))
    gst_structure_remove_field (structure, "pattern");
  if (gst_structure_n_fields (structure) == int (quarks ().size ()))
    gst_structure_map_in_place (
        structure, rewrite_field, const_cast<FrameMeta *> (&meta));
  else
    write_fields (structure, meta);
  if (!meta.pattern.empty ())
    set_field (structure, "pattern", meta.pattern);
}

std::optional<FrameMeta>
get_frame_meta (GstBuffer *buffer)
{
  GstCustomMeta *custom = find (buffer);
  if (!custom)
    return std::nullopt;
  FrameMeta meta;
  const GstStructure *structure = gst_custom_meta_get_structure (custom);
  each_field (meta, [structure] (GQuark quark, auto &member) {
    if (const GValue *value = gst_structure_id_get_value (structure, quark))
      get_value (value, member);
  });
  get_field (structure, "pattern", meta.pattern);
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

} // namespace codedexposure::gst

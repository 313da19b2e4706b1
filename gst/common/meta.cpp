/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "meta.h"

#include <algorithm>

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

GQuark
pattern_quark ()
{
  static const GQuark pattern = g_quark_from_static_string ("pattern");
  return pattern;
}

/* Overwriting a value is much faster than creating it again. */
template <typename T>
void
put_field (GstStructure *structure, GQuark name, const T &member)
{
  if (const GValue *there = gst_structure_id_get_value (structure, name))
    Wire<T>::set (const_cast<GValue *> (there), member);
  else
    set_field (structure, name, member);
}
template <typename T>
void
put_field (GstStructure *structure, GQuark name, const std::optional<T> &member)
{
  if (member)
    put_field (structure, name, *member);
  else if (gst_structure_id_has_field (structure, name))
    gst_structure_remove_field (structure, g_quark_to_string (name));
}

struct MetaCopy {
  GstBuffer *to;
  GstVideoInfo from_info, to_info;
  bool whole; ///< the picture shows the whole frame
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

/* Elements that copy {"video"} metas copy custom ones with this tag, too, even
 * scalers and encoders. */
void
register_meta (const char *name)
{
  static const gchar *tags[] = {"video", nullptr};
  if (!gst_meta_get_info (name))
    gst_meta_register_custom (name, tags, nullptr, nullptr, nullptr);
}

void
set_frame_meta (GstBuffer *buffer, const FrameMeta &meta)
{
  GstCustomMeta *custom = find (buffer);
  if (!custom)
    custom = gst_buffer_add_custom_meta (buffer, kFrameMetaName);
  GstStructure *structure = gst_custom_meta_get_structure (custom);
  if (gst_structure_id_has_field (structure, pattern_quark ()))
    gst_structure_remove_field (structure, "pattern");
  each_field (meta, [structure] (GQuark name, const auto &member) {
    put_field (structure, name, member);
  });
  if (!meta.pattern.empty ())
    set_field (structure, pattern_quark (), meta.pattern);
}

std::optional<FrameMeta>
get_frame_meta (GstBuffer *buffer)
{
  GstCustomMeta *custom = find (buffer);
  if (!custom)
    return std::nullopt;
  FrameMeta meta;
  const GstStructure *structure = gst_custom_meta_get_structure (custom);
  read_fields (structure, meta);
  get_field (structure, pattern_quark (), meta.pattern);
  return meta;
}

int
bits_of (GstBuffer *frame, const GstVideoInfo &info, int set, int tagged)
{
  const auto meta = get_frame_meta (frame);
  const int depth = int (GST_VIDEO_INFO_COMP_DEPTH (&info, 0));
  const int bits = set > 0 ? set : meta ? meta->bits : tagged;
  return bits > 0 ? std::min (bits, depth) : depth;
}

void
copy_metas (GstBuffer *from, const GstVideoInfo &from_info, GstBuffer *to,
    const GstVideoInfo &to_info)
{
  MetaCopy copy{to, from_info, to_info, true};
  gst_buffer_foreach_meta (from, copy_meta, &copy);
}

void
copy_description (GstBuffer *from, const GstVideoInfo &info, GstBuffer *to)
{
  gst_buffer_copy_into (to, from,
      GstBufferCopyFlags (GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS),
      0, -1);
  copy_metas (from, info, to, info);
}

void
copy_metas_to_part (GstBuffer *from, GstBuffer *to)
{
  MetaCopy copy{to, {}, {}, false};
  gst_buffer_foreach_meta (from, copy_meta, &copy);
}

} // namespace codedexposure::gst

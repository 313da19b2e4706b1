/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "common/partner.h"

namespace codedexposure::gst
{

const char *const kPartnerMetaName = "CodedExposurePartner";

void
register_partner_meta ()
{
  static const gchar *tags[] = {GST_META_TAG_VIDEO_STR,
      GST_META_TAG_VIDEO_SIZE_STR, GST_META_TAG_VIDEO_ORIENTATION_STR, nullptr};
  if (!gst_meta_get_info (kPartnerMetaName))
    gst_meta_register_custom (
        kPartnerMetaName, tags, nullptr, nullptr, nullptr);
}

void
set_partner (GstBuffer *coded, const Partner &partner)
{
  GstCustomMeta *meta = gst_buffer_get_custom_meta (coded, kPartnerMetaName);
  if (!meta)
    meta = gst_buffer_add_custom_meta (coded, kPartnerMetaName);
  gst_structure_set (gst_custom_meta_get_structure (meta), "buffer",
      GST_TYPE_BUFFER, partner.buffer.get (), "caps", GST_TYPE_CAPS,
      partner.caps.get (), nullptr);
}

std::optional<Partner>
get_partner (GstBuffer *coded)
{
  GstCustomMeta *meta = gst_buffer_get_custom_meta (coded, kPartnerMetaName);
  if (!meta)
    return std::nullopt;
  GstBuffer *buffer = nullptr;
  GstCaps *caps = nullptr;
  const bool complete =
      gst_structure_get (gst_custom_meta_get_structure (meta), "buffer",
          GST_TYPE_BUFFER, &buffer, "caps", GST_TYPE_CAPS, &caps, nullptr);
  Partner partner{BufferPtr (buffer), CapsPtr (caps)};
  return complete ? std::optional (std::move (partner)) : std::nullopt;
}

} // namespace codedexposure::gst

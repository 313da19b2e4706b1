/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The partner of a coded frame, the frame of the beam of the mirrors that are
 * off, in a GstCustomMeta of the coded frame. */
#pragma once

#include <optional>

#include <gst/gst.h>

#include "common/raii.h"

namespace codedexposure::gst
{

/** Name of the custom meta, "CodedExposurePartner", with the fields `buffer`
 * and `caps`. It is tagged {"video", "size", "orientation"}: whatever changes
 * the pixels of the coded frame drops it. It does not leave the process. */
extern const char *const kPartnerMetaName;

struct Partner {
  BufferPtr buffer;
  CapsPtr caps;
};

/** Before the others; each plugin does. */
void register_partner_meta ();
/** Gives @p coded, which must be writable, a partner. */
void set_partner (GstBuffer *coded, const Partner &partner);
std::optional<Partner> get_partner (GstBuffer *coded);

} // namespace codedexposure::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "common/elements.h"
#include "common/meta.h"
#include "common/partner.h"
#include "parts.h"

gboolean
codedexposure::gst::register_devices (GstPlugin *plugin)
{
  register_meta (kFrameMetaName);
  register_partner_meta ();
#ifdef CODEDEXPOSURE_ARAVIS
  if (!GST_DEVICE_PROVIDER_REGISTER (codedexposure_cameraprovider, plugin))
    return FALSE;
#endif
  return GST_ELEMENT_REGISTER (codedexposure_camerasrc, plugin) &&
         GST_ELEMENT_REGISTER (moirecalib, plugin);
}

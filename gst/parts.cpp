/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "parts.h"

#include "common/elements.h"
#include "common/meta.h"
#include "common/partner.h"

namespace codedexposure::gst
{

/* dmdsync and the simulated bench share the mirrors of a process, so they are
 * in the same plugin. */
gboolean
register_elements (GstPlugin *plugin)
{
  register_meta (kFrameMetaName);
  register_partner_meta ();
  return GST_ELEMENT_REGISTER (codedexposure_demux, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_filesink, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_keep, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_recorddemux, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_recordmux, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_scene, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_sim, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_view, plugin) &&
         GST_ELEMENT_REGISTER (dmdsync, plugin) &&
         register_more_elements (plugin);
}

} // namespace codedexposure::gst

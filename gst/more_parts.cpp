/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "common/elements.h"
#include "common/meta.h"
#include "common/stats_report.h"
#include "parts.h"

gboolean
codedexposure::gst::register_more_elements (GstPlugin *plugin)
{
  register_meta (kStatsMetaName);
  return GST_ELEMENT_REGISTER (codedexposure_fuse, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_pair, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_sum, plugin) &&
         GST_ELEMENT_REGISTER (subframestats, plugin);
}

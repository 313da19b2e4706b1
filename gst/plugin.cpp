/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The plugin: registers its elements, nothing else. */
#include <gst/gst.h>

#include "bench/simulated_dmd.h"
#include "common/elements.h"
#include "common/meta.h"
#include "common/stats_report.h"

static gboolean
plugin_init (GstPlugin *plugin)
{
  using namespace codedexposure::gst;
  register_meta (kFrameMetaName);
  register_meta (kStatsMetaName);
  codedexposure::serve_simulated_dmds ();
#ifdef CODEDEXPOSURE_ARAVIS
  if (!GST_DEVICE_PROVIDER_REGISTER (codedexposure_cameraprovider, plugin))
    return FALSE;
#endif
  return GST_ELEMENT_REGISTER (codedexposure_camerasrc, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_demux, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_filesink, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_fuse, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_recorddemux, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_recordmux, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_scene, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_sim, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_view, plugin) &&
         GST_ELEMENT_REGISTER (dmdsync, plugin) &&
         GST_ELEMENT_REGISTER (moirecalib, plugin) &&
         GST_ELEMENT_REGISTER (subframestats, plugin);
}

GST_PLUGIN_DEFINE (GST_VERSION_MAJOR, GST_VERSION_MINOR, codedexposure,
    "Per-pixel coded exposure: a fast camera from a slow one and a DMD",
    plugin_init, PACKAGE_VERSION, "LGPL", PACKAGE, "gst-codedexposure")

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The plugin: registers its elements, nothing else. */
#include <gst/gst.h>

#include "gstcodedexposuredemux.h"
#include "gstcodedexposurefuse.h"
#include "gstcodedexposurelog.h"
#include "gstcodedexposuremeta.h"
#include "gstcodedexposurescene.h"
#include "gstcodedexposuresim.h"
#include "gstcodedexposureview.h"
#include "gstdmdsync.h"
#include "gstmoirecalib.h"
#include "gstsubframestats.h"
#include "gstsubframestatsreport.h"

static gboolean
plugin_init (GstPlugin *plugin)
{
  cexp::gst::register_frame_meta ();
  cexp::gst::register_stats_meta ();
  return GST_ELEMENT_REGISTER (codedexposure_demux, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_fuse, plugin) &&
         GST_ELEMENT_REGISTER (codedexposure_log, plugin) &&
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

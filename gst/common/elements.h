/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The elements of the plugin, and the device provider of GenICam cameras. */
#pragma once

#include <gst/gst.h>

GST_ELEMENT_REGISTER_DECLARE (codedexposure_camerasrc);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_demux);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_filesink);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_fuse);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_keep);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_pair);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_recorddemux);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_recordmux);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_scene);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_sim);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_sum);
GST_ELEMENT_REGISTER_DECLARE (codedexposure_view);
GST_ELEMENT_REGISTER_DECLARE (dmdsync);
GST_ELEMENT_REGISTER_DECLARE (moirecalib);
GST_ELEMENT_REGISTER_DECLARE (subframestats);
GST_DEVICE_PROVIDER_REGISTER_DECLARE (codedexposure_cameraprovider);

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The elements inside of codedexposure-recordmux and -recorddemux; they are not
 * registered. */
#pragma once

#include <string>

#include <gst/gst.h>

GType gst_coded_exposure_log_get_type ();
GType gst_coded_exposure_restore_get_type ();

namespace codedexposure::gst
{

/** An element of the unregistered @p type. */
inline GstElement *
make_part (GType type)
{
  return GST_ELEMENT (g_object_new (type, nullptr));
}

/** An error: the element @p factory is not installed. */
inline std::string
missing (const std::string &factory)
{
  return "The GStreamer element " + factory +
         " is not installed. It is in the package gstreamer1.0-" +
         (factory.starts_with ("av") ? "libav." : "plugins-good.");
}

} // namespace codedexposure::gst

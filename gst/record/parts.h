/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The elements inside of codedexposure-recordmux and -recorddemux; they are not
 * registered. */
#pragma once

#include <string>

#include <gst/gst.h>

#include "common/element.h"
#include "common/raii.h"

GType gst_coded_exposure_log_get_type ();
GType gst_coded_exposure_restore_get_type ();

namespace codedexposure::gst
{

/** Frames, or frames that are encoded. */
inline constexpr const char *kPartCaps =
    CODED_EXPOSURE_VIDEO_CAPS ";video/x-ffv";

inline bool
is_encoded (const GstCaps *caps)
{
  return gst_structure_has_name (
      gst_caps_get_structure (caps, 0), "video/x-ffv");
}

/** Posts an error if @p frame is too short for @p info. avenc_ffv1 of GStreamer
 * 1.22 would release it twice. */
inline bool
holds_frame (gpointer element, const GstVideoInfo &info, GstBuffer *frame)
{
  const auto layout = layout_of (info, frame);
  if (!layout)
    POST_ERROR (element, STREAM, FORMAT, layout.error ().message);
  return bool (layout);
}

/** Those of a part that passes frames. */
inline void
add_part_templates (gpointer klass)
{
  for (const char *pad : {"sink", "src"})
    add_pad_template (klass, pad, {.caps = kPartCaps});
}

/** An element of the unregistered @p type. */
inline GstElement *
make_part (GType type)
{
  return GST_ELEMENT (g_object_new (type, nullptr));
}

/** A queue for so many @p buffers, whatever their size; 0: for any number. */
inline GstElement *
make_queue (guint buffers)
{
  GstElement *queue = gst_element_factory_make ("queue", nullptr);
  g_object_set (queue, "max-size-buffers", buffers, "max-size-bytes", 0u,
      "max-size-time", guint64 (0), nullptr);
  return queue;
}

/** Stops @p part of @p bin, which then has it no longer; null: does nothing. */
inline void
remove_part (GstElement *bin, GstElement *&part)
{
  if (!part)
    return;
  gst_element_set_state (part, GST_STATE_NULL);
  gst_bin_remove (GST_BIN (bin), part);
  part = nullptr;
}

/** A warning. */
inline constexpr const char *kOtherVideo =
    "The file has more video than the frames of this recording, such as "
    "another recording, which is not read. Use each recording from a file of "
    "its own.";

/** An error: the element @p factory is not installed. */
inline std::string
missing (const std::string &factory)
{
  return "The GStreamer element " + factory +
         " is not installed. It is in the package gstreamer1.0-" +
         (factory.starts_with ("av") ? "libav." : "plugins-good.");
}

} // namespace codedexposure::gst

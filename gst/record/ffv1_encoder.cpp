/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "ffv1_encoder.h"

#include <algorithm>
#include <string>

#include "common/raii.h"

namespace codedexposure::gst
{

namespace
{

/* Pixels of the shorter side. */
int
shorter_side (const GstCaps *caps)
{
  int width = 0, height = 0;
  gst_structure_get (gst_caps_get_structure (caps, 0), "width", G_TYPE_INT,
      &width, "height", G_TYPE_INT, &height, nullptr);
  return std::min (width, height);
}

/* Four slices are two rows of two, and pixels of a slice of one row or column
 * are lost as well. */
GstPadProbeReturn
on_event (GstPad *, GstPadProbeInfo *info, gpointer encoder) noexcept
{
  GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
  if (GST_EVENT_TYPE (event) == GST_EVENT_CAPS)
    g_object_set (
        encoder, "slices", shorter_side (caps_of (event)) < 4 ? 1 : 4, nullptr);
  return GST_PAD_PROBE_OK;
}

} // namespace

GstElement *
make_ffv1_encoder (guint threads)
{
  GstElement *encoder = gst_element_factory_make ("avenc_ffv1", nullptr);
  if (!encoder)
    return nullptr;
  g_object_set (encoder, "gop-size", 1, nullptr);
  gst_util_set_object_arg (G_OBJECT (encoder), "threads",
      threads == 0 ? "auto" : std::to_string (threads).c_str ());
  gst_pad_add_probe (pad_of (encoder, "sink").get (),
      GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, on_event, encoder, nullptr);
  return encoder;
}

bool
ffv1_keeps (const GstCaps *caps)
{
  return shorter_side (caps) > 1;
}

} // namespace codedexposure::gst

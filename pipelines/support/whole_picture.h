/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <string_view>

#include <gst/video/gstvideoaggregator.h>

#include "common/raii.h"
#include "each_element.h"

/** A compositor of live streams does not wait for inputs that are late. Its
 * first pictures are then smaller, and some windows keep the size of the first
 * picture. */
namespace whole_picture
{

/* Called by the compositor's own thread, which alone changes what it asks. */
inline bool
has_all_inputs (GstElement *compositor)
{
  return gst_element_foreach_sink_pad (
      compositor,
      [] (GstElement *, GstPad *pad, gpointer) -> gboolean {
        return GST_VIDEO_INFO_WIDTH (&GST_VIDEO_AGGREGATOR_PAD (pad)->info) >
                   0 ||
               gst_aggregator_pad_is_eos (GST_AGGREGATOR_PAD (pad));
      },
      nullptr);
}

/* Sticky events that are dropped come again before the next frame. */
inline GstPadProbeReturn
on_output (GstPad *pad, GstPadProbeInfo *info, gpointer)
{
  const codedexposure::gst::ObjectPtr<GstElement> compositor (
      gst_pad_get_parent_element (pad));
  const bool ends =
      (info->type & GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM) &&
      GST_EVENT_TYPE (gst_pad_probe_info_get_event (info)) == GST_EVENT_EOS;
  return ends || !compositor || has_all_inputs (compositor.get ())
             ? GST_PAD_PROBE_REMOVE
             : GST_PAD_PROBE_DROP;
}

/** The compositors of @p pipeline show nothing until all of their inputs have a
 * size or have ended. */
inline void
wait_for_inputs (GstElement *pipeline)
{
  for_each_element (pipeline, [] (GstElement *element) {
    const GstElementFactory *factory = gst_element_get_factory (element);
    if (!factory ||
        GST_OBJECT_NAME (factory) != std::string_view ("compositor"))
      return;
    const codedexposure::gst::ObjectPtr<GstPad> output (
        gst_element_get_static_pad (element, "src"));
    gst_pad_add_probe (output.get (), GST_PAD_PROBE_TYPE_DATA_DOWNSTREAM,
        on_output, nullptr, nullptr);
  });
}

} // namespace whole_picture

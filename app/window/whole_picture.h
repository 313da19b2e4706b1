/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A compositor of live streams does not wait for inputs that are late. Its
 * first pictures are then smaller, and some windows keep the size of the first
 * picture. */
#pragma once

#include <gst/video/gstvideoaggregator.h>

#include "common/raii.h"
#include "pipeline/graph.h"
#include "pipeline/pads.h"

namespace codedexposure::app
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

/** @p compositor shows nothing until all of its inputs have a size or have
 * ended. */
inline void
wait_for_inputs (GstElement *compositor)
{
  /* Sticky events that are dropped come again before the next frame. */
  add_probe (pad_of (compositor, "src").get (),
      GST_PAD_PROBE_TYPE_DATA_DOWNSTREAM,
      [compositor] (GstPad *, GstPadProbeInfo *info) {
        const bool ends = (info->type & GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM) &&
                          GST_EVENT_TYPE (gst_pad_probe_info_get_event (
                              info)) == GST_EVENT_EOS;
        return ends || has_all_inputs (compositor) ? GST_PAD_PROBE_REMOVE
                                                   : GST_PAD_PROBE_DROP;
      });
}

} // namespace codedexposure::app

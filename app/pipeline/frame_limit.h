/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <gst/gst.h>

#include "common/raii.h"

namespace codedexposure::app
{

/** Ends the stream directly after the last frame that an identity lets through.
 * The identity itself ends it when it refuses the next frame, which was already
 * produced and counted. */
class FrameLimit
{
public:
  /** @p identity  has eos-after; this outlives its pads' activity. */
  explicit FrameLimit (GstElement *identity)
  {
    gint refused = 0;
    g_object_get (identity, "eos-after", &refused, nullptr);
    left_ = refused - 1;
    const gst::ObjectPtr<GstPad> src (
        gst_element_get_static_pad (identity, "src"));
    gst_pad_add_probe (
        src.get (), GST_PAD_PROBE_TYPE_BUFFER, on_frame, this, nullptr);
  }
  FrameLimit (const FrameLimit &) = delete;
  FrameLimit &operator= (const FrameLimit &) = delete;

private:
  static GstPadProbeReturn on_frame (
      GstPad *pad, GstPadProbeInfo *info, gpointer self)
  {
    if (--static_cast<FrameLimit *> (self)->left_ != 0)
      return GST_PAD_PROBE_OK;
    /* The push calls this probe again. */
    GstBuffer *last = GST_PAD_PROBE_INFO_BUFFER (info);
    GST_PAD_PROBE_INFO_DATA (info) = nullptr;
    const GstFlowReturn flow = gst_pad_push (pad, last);
    GST_PAD_PROBE_INFO_FLOW_RETURN (info) =
        flow == GST_FLOW_OK ? GST_FLOW_EOS : flow;
    return GST_PAD_PROBE_HANDLED;
  }

  gint64 left_ = 0; // frames until the limit; thread of the pad
};

} // namespace codedexposure::app

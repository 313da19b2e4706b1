/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the inner muxer of codedexposure-recordmux gets of one camera. */
#pragma once

#include <gst/gst.h>
#include <gst/video/video.h>

namespace codedexposure::gst
{

/** The muxer's pads for the two tracks of a camera. What comes to them is
 * changed to what matroskamux stores correctly: it takes 16-bit grey under
 * another name only, looks at no strides, and writes in the order of DTS. */
struct MuxerInput {
  GstPad *video = nullptr, *text = nullptr; ///< the muxer owns them

  /** Requests the pads from @p mux. Stays in its place from then on. */
  void request_from (GstElement *mux);
  /** Before a run, and after a flush. */
  void restart () { frame_order = line_order = GST_CLOCK_TIME_NONE; }

  /* Streaming threads: */
  GstVideoInfo raw = {}; ///< of frames that are not encoded
  /** DTS of the last frame, and of the last line. */
  GstClockTime frame_order = GST_CLOCK_TIME_NONE;
  GstClockTime line_order = GST_CLOCK_TIME_NONE;
};

} // namespace codedexposure::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What goes into the inner muxer of codedexposure-recordmux, and what comes out
 * of it. */
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

/**
 * What the muxer gives, changed item by item for programs other than GStreamer.
 * No byte moves in a file:
 *
 * - The head has the FourCC of FFmpeg for 16-bit grey, and a text track that is
 *   not the default, so players do not show its lines on the pictures unasked;
 *   so has the head in the caps of a stream, which late receivers get.
 * - Texts of tags, which the muxer quotes and escapes, are plain.
 */
class MuxerOutput
{
public:
  /** Before a run. */
  void restart () { *this = {}; }
  /** For a probe of buffers and downstream events at the muxer's source pad. */
  void rewrite (GstPadProbeInfo *info);

private:
  bool has_frames_ = false, has_tags_ = false;
};

} // namespace codedexposure::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The part of codedexposure-recorddemux that reads the two tracks of a camera,
 * frames and lines. */
#pragma once

#include <gst/gst.h>

#include "base/geometry.h"
#include "common/raii.h"
#include "schedule/timing.h"
#include "segment.h"

namespace codedexposure::gst
{

/** How frames are read. */
struct FrameReading {
  bool decode = true;
  int threads = 0; ///< of the decoder; 0: one for each processor
  /* As the head of the file says: */
  Extent size = {0, 0};     ///< 0x0: not known
  int pixel_bytes = 0;      ///< of raw frames; 0: not known
  Nanoseconds duration = 0; ///< of a frame; 0: not known
};

/** Streaming thread of the demuxer, and changes of the state. */
class CameraTracks
{
public:
  /** In the bin @p element. */
  explicit CameraTracks (GstElement *element) : element_ (element) {}

  /** Makes the part restore, which has frames and lines come together. */
  void begin (Nanoseconds tick);
  /** Adds it to the bin. Before a run, its pads are not linked yet, and
   * gst_parse_bin_from_description () would take them for those of its bin. */
  void add_restore ();
  /** Null: not begun. */
  GstElement *restore () const { return restore_.get (); }
  /** To which the container rounds times. */
  void set_tick (Nanoseconds tick);

  /** From the demuxer's pad @p pad; posts an error if they are none of a
   * recording, or their decoder is missing. */
  void add_frames (GstPad *pad, const FrameReading &how);
  bool has_frames () const { return queue_; }
  /** After add_frames (): the part that takes its frames is told of segments
   * that a seek leaves. */
  void tell_left_segments ();
  void add_lines (GstPad *pad);

  /** Removes what add_frames () made. */
  void end ();
  /** And the part restore. */
  void remove ();

private:
  /** Of raw frames with 16-bit pixels. */
  struct Deep {
    CapsPtr caps;
    gsize frame_bytes = 0;
  };

  static GstPadProbeReturn on_caps (
      GstPad *, GstPadProbeInfo *info, gpointer self) noexcept;
  static GstPadProbeReturn on_deep_frame (
      GstPad *, GstPadProbeInfo *info, gpointer self) noexcept;
  static guint frames_queued (GstElement *, gpointer self) noexcept;
  static GstPadProbeReturn on_read (
      GstPad *pad, GstPadProbeInfo *info, gpointer self) noexcept;
  static GstPadProbeReturn on_decoded (
      GstPad *, GstPadProbeInfo *info, gpointer self) noexcept;
  static GstFlowReturn decode (
      GstPad *pad, GstObject *decoder, GstBuffer *frame) noexcept;
  bool take_raw (GstPad *pad, const GstCaps *caps, const FrameReading &how);
  bool make_decoder (GstPad *pad, const GstCaps *caps, const FrameReading &how);

  GstElement *element_;
  ObjectPtr<GstElement> restore_;
  GstElement *queue_ = nullptr, *decoder_ = nullptr;
  GstPadChainFunction decode_ = nullptr; ///< of the decoder
  Deep deep_;
  Nanoseconds duration_ = 0; ///< of a frame, by the head; 0: not known
  GstClockTime decoded_ = GST_CLOCK_TIME_NONE; ///< time of the last frame
  SegmentLeft segment_;                        ///< that is read
};

} // namespace codedexposure::gst

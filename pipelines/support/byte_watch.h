/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <atomic>

#include <gst/gst.h>

#include "common/raii.h"

/** Ends a stream of which much arrives without a frame: a demuxer collects an
 * element of any length that a stream claims. */
class ByteWatch
{
public:
  static constexpr gsize kMostWithoutFrame = gsize (256) << 20;

  /** @p demuxer  takes the bytes; posts the error.
   * @p frames   counts the frames that came out. Both outlive this. */
  ByteWatch (GstElement *demuxer, const std::atomic<gint64> &frames)
      : demuxer_ (demuxer), frames_ (frames)
  {
    const codedexposure::gst::ObjectPtr<GstPad> sink (
        gst_element_get_static_pad (demuxer, "sink"));
    gst_pad_add_probe (
        sink.get (), GST_PAD_PROBE_TYPE_BUFFER, on_bytes, this, nullptr);
  }
  ByteWatch (const ByteWatch &) = delete;
  ByteWatch &operator= (const ByteWatch &) = delete;

private:
  static GstPadProbeReturn on_bytes (
      GstPad *, GstPadProbeInfo *info, gpointer self)
  {
    auto *watch = static_cast<ByteWatch *> (self);
    if (const gint64 frames = watch->frames_; watch->seen_ != frames) {
      watch->seen_ = frames;
      watch->bytes_ = 0;
    }
    watch->bytes_ += gst_buffer_get_size (GST_PAD_PROBE_INFO_BUFFER (info));
    if (watch->bytes_ <= kMostWithoutFrame)
      return GST_PAD_PROBE_OK;
    GST_ELEMENT_ERROR (watch->demuxer_, STREAM, DEMUX,
        ("256 MB arrived without a frame: this is no stream of coded frames, "
         "or it is damaged."),
        (nullptr));
    /* The source then ends the stream. */
    gst_clear_buffer (reinterpret_cast<GstBuffer **> (&info->data));
    GST_PAD_PROBE_INFO_FLOW_RETURN (info) = GST_FLOW_ERROR;
    return GST_PAD_PROBE_HANDLED;
  }

  GstElement *demuxer_;
  const std::atomic<gint64> &frames_;
  /* Thread of the pad. */
  gint64 seen_ = 0;
  gsize bytes_ = 0; // since the last frame
};

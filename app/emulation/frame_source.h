/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Coded frames of a pipeline, one by one. */
#pragma once

#include <algorithm>
#include <atomic>
#include <memory>
#include <string>

#include <gst/app/gstappsink.h>

#include "base/image.h"
#include "base/result.h"
#include "common/raii.h"
#include "pipeline/graph.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

/** Plays a pipeline as fast as its frames are taken. */
class FrameSource
{
public:
  /** Appends a sink to @p chain, whose graph outlives this, and waits for the
   * first frame. @p loop  begins again at the end. */
  static Result<std::unique_ptr<FrameSource>> open (Chain &chain, bool loop)
  {
    chain.caps ("video/x-raw,format={GRAY8,GRAY16_LE}")
        .to ("appsink", {{"sync", false}, {"max-buffers", 4}});
    auto frames = std::unique_ptr<FrameSource> (new FrameSource);
    frames->pipeline_ = chain.graph ().pipeline ();
    frames->sink_ = GST_APP_SINK (chain.last ());
    frames->loop_ = loop;
    gst_element_set_state (frames->pipeline_, GST_STATE_PLAYING);
    if (!frames->advance ())
      return Error{frames->why_ended ()};
    return frames;
  }

  ~FrameSource () { gst_element_set_state (pipeline_, GST_STATE_NULL); }
  FrameSource (const FrameSource &) = delete;
  FrameSource &operator= (const FrameSource &) = delete;

  const GstVideoInfo &info () const { return info_; }
  /** Any thread. */
  bool ended () const { return ended_; }

  std::string why_ended () const
  {
    const auto message = next_message (pipeline_, GST_MESSAGE_ERROR);
    return message ? Told (message.get ()).error->message
                   : "the scene has ended";
  }

  /** Copies the next frame; false at the end. */
  bool take (ImageView<std::uint16_t> picture)
  {
    if (!sample_ && !advance ())
      return false;
    gst::MappedFrame mapped (
        info_, gst_sample_get_buffer (sample_.get ()), GST_MAP_READ);
    if (mapped)
      gst::read_pixels (mapped, [&picture] (auto pixels) {
        for (int y = 0; y < picture.height; y++)
          std::copy_n (pixels.row (y), picture.width, picture.row (y));
      });
    mapped.reset ();
    sample_.reset ();
    return true;
  }

private:
  FrameSource () = default;

  bool advance ()
  {
    sample_.reset (gst_app_sink_pull_sample (sink_));
    if (!sample_ && loop_ && gst_app_sink_is_eos (sink_) &&
        gst_element_seek_simple (
            pipeline_, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, 0))
      sample_.reset (gst_app_sink_pull_sample (sink_));
    ended_ = !sample_ || !gst_video_info_from_caps (
                             &info_, gst_sample_get_caps (sample_.get ()));
    return !ended_;
  }

  GstElement *pipeline_ = nullptr;
  GstAppSink *sink_ = nullptr;
  gst::SamplePtr sample_;
  GstVideoInfo info_ = {};
  bool loop_ = false;
  std::atomic<bool> ended_ = false;
};

} // namespace codedexposure::app

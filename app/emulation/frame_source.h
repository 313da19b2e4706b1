/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Coded frames of a pipeline, one by one. */
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include <gst/app/gstappsink.h>

#include "base/image.h"
#include "base/result.h"
#include "common/raii.h"
#include "pipeline/graph.h"

namespace codedexposure::app
{

/** Plays a pipeline as fast as its frames are taken. */
class FrameSource
{
public:
  /** Appends a sink to @p chain, whose graph outlives this, and waits for the
   * first frame. @p loop  begins again at the end. */
  static Result<std::unique_ptr<FrameSource>> open (Chain &chain, bool loop);
  ~FrameSource ();
  FrameSource (const FrameSource &) = delete;
  FrameSource &operator= (const FrameSource &) = delete;

  const GstVideoInfo &info () const { return info_; }
  /** Any thread. */
  bool ended () const { return ended_; }
  std::string why_ended () const;

  /** Copies the next frame; false at the end. */
  bool take (ImageView<std::uint16_t> picture);

private:
  FrameSource () = default;
  bool advance ();

  GstElement *pipeline_ = nullptr;
  GstAppSink *sink_ = nullptr;
  gst::SamplePtr sample_;
  GstVideoInfo info_ = {};
  bool loop_ = false;
  std::atomic<bool> ended_ = false;
};

} // namespace codedexposure::app

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <atomic>
#include <string>

#include <gst/gst.h>

#include "pipeline/graph.h"
#include "pipeline/messages.h"
#include "pipeline/pads.h"

namespace codedexposure::app
{

/** Counts the frames that a leaky queue drops, because the queue does not. */
class LeakyQueue
{
public:
  explicit LeakyQueue (GstElement *queue) : name_ (GST_OBJECT_NAME (queue))
  {
    watch_buffers (pad_of (queue, "sink").get (),
        [this] (GstPad *, GstBuffer *) { in_++; });
    watch_buffers (pad_of (queue, "src").get (),
        [this] (GstPad *, GstBuffer *) { out_++; });
  }
  LeakyQueue (const LeakyQueue &) = delete;
  LeakyQueue &operator= (const LeakyQueue &) = delete;

  std::string counters () const
  {
    return format ("%s: in=%" G_GINT64_FORMAT " skipped=%" G_GINT64_FORMAT,
        name_.c_str (), in_.load (), in_.load () - out_.load ());
  }

private:
  std::string name_;
  std::atomic<gint64> in_ = 0, out_ = 0;
};

} // namespace codedexposure::app

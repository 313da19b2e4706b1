/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <algorithm>
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
  explicit LeakyQueue (GstElement *queue)
      : queue_ (GST_ELEMENT (gst_object_ref (queue)))
  {
    watch_buffers (pad_of (queue, "sink").get (),
        [this] (GstPad *, GstBuffer *) { in_++; });
    watch_buffers (pad_of (queue, "src").get (),
        [this] (GstPad *, GstBuffer *) { out_++; });
  }
  LeakyQueue (const LeakyQueue &) = delete;
  LeakyQueue &operator= (const LeakyQueue &) = delete;

  bool is_before (const GstElement *element) const
  {
    return element_behind (pad_of (queue_.get (), "src").get ()).get () ==
           element;
  }

  /** Without those that wait. */
  gint64 skipped () const
  {
    guint waiting = 0;
    g_object_get (queue_.get (), "current-level-buffers", &waiting, nullptr);
    return std::max<gint64> (in_ - out_ - waiting, 0);
  }

  std::string counters () const
  {
    return format ("%s: in=%" G_GINT64_FORMAT " skipped=%" G_GINT64_FORMAT,
        GST_OBJECT_NAME (queue_.get ()), in_.load (), skipped ());
  }

private:
  gst::ObjectPtr<GstElement> queue_; // it may leave the pipeline
  std::atomic<gint64> in_ = 0, out_ = 0;
};

} // namespace codedexposure::app

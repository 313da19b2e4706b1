/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <atomic>
#include <string>

#include <gst/gst.h>

#include "common/raii.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

/** Counts the frames that a leaky queue drops, because the queue does not. */
class LeakyQueue
{
public:
  explicit LeakyQueue (GstElement *queue) : name_ (GST_OBJECT_NAME (queue))
  {
    count (queue, "sink", in_);
    count (queue, "src", out_);
  }
  LeakyQueue (const LeakyQueue &) = delete;
  LeakyQueue &operator= (const LeakyQueue &) = delete;

  std::string counters () const
  {
    return format ("%s: in=%" G_GINT64_FORMAT " skipped=%" G_GINT64_FORMAT,
        name_.c_str (), in_.load (), in_.load () - out_.load ());
  }

private:
  static void count (
      GstElement *queue, const char *pad_name, std::atomic<gint64> &buffers)
  {
    const gst::ObjectPtr<GstPad> pad (
        gst_element_get_static_pad (queue, pad_name));
    gst_pad_add_probe (
        pad.get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *, GstPadProbeInfo *, gpointer counter) {
          (*static_cast<std::atomic<gint64> *> (counter))++;
          return GST_PAD_PROBE_OK;
        },
        &buffers, nullptr);
  }

  std::string name_;
  std::atomic<gint64> in_ = 0, out_ = 0;
};

} // namespace codedexposure::app

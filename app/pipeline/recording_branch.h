/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The part of a pipeline that records, beside one that is watched. */
#pragma once

#include <algorithm>
#include <atomic>
#include <utility>
#include <vector>

#include "pipeline/graph.h"
#include "pipeline/pads.h"

namespace codedexposure::app
{

/** All elements from a queue on. If one of them fails, such as on a full disk,
 * the branch can be cut off, and the rest of the pipeline goes on. */
class RecordingBranch
{
public:
  /** @p queue  the first element, which never blocks. */
  RecordingBranch (GstElement *pipeline, GstElement *queue)
      : pipeline_ (pipeline), bus_ (gst_element_get_bus (pipeline))
  {
    entry_.reset (gst_pad_get_peer (pad_of (queue, "sink").get ()));
    add (queue);
    gst_bus_enable_sync_message_emission (bus_);
    handler_ = g_signal_connect (
        bus_, "sync-message::error", G_CALLBACK (on_error), this);
  }

  ~RecordingBranch ()
  {
    g_signal_handler_disconnect (bus_, handler_);
    gst_bus_disable_sync_message_emission (bus_);
    gst_object_unref (bus_);
  }

  RecordingBranch (const RecordingBranch &) = delete;
  RecordingBranch &operator= (const RecordingBranch &) = delete;

  /** Also those in its bins. */
  bool has (GstObject *element) const
  {
    return std::ranges::any_of (elements_, [element] (const auto &own) {
      return GST_OBJECT (own.get ()) == element ||
             gst_object_has_as_ancestor (element, GST_OBJECT (own.get ()));
    });
  }

  /** Stops and removes all elements of the branch; they exist until this is
   * destroyed. On the thread of the main loop, after the error of one. A sink
   * that has failed would never say that the stream has ended. */
  void remove ()
  {
    if (std::exchange (removed_, true))
      return;
    for (const auto &element : elements_) {
      gst_element_set_locked_state (element.get (), TRUE);
      gst_element_set_state (element.get (), GST_STATE_NULL);
    }
    for (const auto &element : elements_)
      gst_bin_remove (GST_BIN (pipeline_), element.get ());
  }

  bool is_removed () const { return removed_; }

private:
  /* And those behind it. */
  void add (GstElement *element)
  {
    if (has (GST_OBJECT (element)))
      return;
    elements_.emplace_back (GST_ELEMENT (gst_object_ref (element)));
    const auto add_next = [] (GstElement *, GstPad *pad, gpointer self) {
      if (const auto next = element_behind (pad))
        static_cast<RecordingBranch *> (self)->add (next.get ());
      return gboolean (TRUE);
    };
    gst_element_foreach_src_pad (element, add_next, this);
  }

  /* A frame that is on its way into the queue has arrived when its stream lock
   * is free; the queue does not block. */
  void cut ()
  {
    add_probe (entry_.get (),
        GST_PAD_PROBE_TYPE_DATA_DOWNSTREAM | GST_PAD_PROBE_TYPE_EVENT_FLUSH,
        [] (GstPad *, GstPadProbeInfo *) { return GST_PAD_PROBE_DROP; });
    const gst::ObjectPtr<GstPad> sink (gst_pad_get_peer (entry_.get ()));
    GST_PAD_STREAM_LOCK (sink.get ());
    GST_PAD_STREAM_UNLOCK (sink.get ());
  }

  /* In the thread of the element, before it returns an error, which would reach
   * the rest of the pipeline with the next frame. */
  static void on_error (GstBus *, GstMessage *message, gpointer self)
  {
    auto *branch = static_cast<RecordingBranch *> (self);
    if (branch->has (GST_MESSAGE_SRC (message)) &&
        !branch->cut_.exchange (true))
      branch->cut ();
  }

  GstElement *pipeline_;
  GstBus *bus_;
  gulong handler_;
  gst::ObjectPtr<GstPad> entry_; // before the queue
  std::vector<gst::ObjectPtr<GstElement>> elements_;
  std::atomic<bool> cut_ = false;
  bool removed_ = false;
};

} // namespace codedexposure::app

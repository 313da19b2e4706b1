/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "recording_branch.h"

#include <algorithm>
#include <utility>

namespace codedexposure::app
{

using namespace gst;

RecordingBranch::RecordingBranch (GstElement *pipeline, GstElement *queue)
    : pipeline_ (pipeline), bus_ (gst_element_get_bus (pipeline))
{
  const ObjectPtr<GstPad> sink (gst_element_get_static_pad (queue, "sink"));
  entry_.reset (gst_pad_get_peer (sink.get ()));
  add (queue);
  gst_bus_enable_sync_message_emission (bus_);
  handler_ = g_signal_connect (
      bus_, "sync-message::error", G_CALLBACK (on_error), this);
}

RecordingBranch::~RecordingBranch ()
{
  g_signal_handler_disconnect (bus_, handler_);
  gst_bus_disable_sync_message_emission (bus_);
  gst_object_unref (bus_);
}

bool
RecordingBranch::has (GstObject *element) const
{
  return std::ranges::any_of (elements_, [element] (const auto &own) {
    return GST_OBJECT (own.get ()) == element ||
           gst_object_has_as_ancestor (element, GST_OBJECT (own.get ()));
  });
}

/* And those behind it. */
void
RecordingBranch::add (GstElement *element)
{
  if (has (GST_OBJECT (element)))
    return;
  elements_.emplace_back (GST_ELEMENT (gst_object_ref (element)));
  const auto add_peer = [] (GstElement *, GstPad *pad, gpointer self) {
    const ObjectPtr<GstPad> peer (gst_pad_get_peer (pad));
    const ObjectPtr<GstElement> next (
        peer ? gst_pad_get_parent_element (peer.get ()) : nullptr);
    if (next)
      static_cast<RecordingBranch *> (self)->add (next.get ());
    return gboolean (TRUE);
  };
  gst_element_foreach_src_pad (element, add_peer, this);
}

/* In the thread of the element, before it returns an error, which would reach
 * the rest of the pipeline with the next frame. */
void
RecordingBranch::on_error (GstBus *, GstMessage *message, gpointer self)
{
  auto *branch = static_cast<RecordingBranch *> (self);
  if (branch->has (GST_MESSAGE_SRC (message)) && !branch->cut_.exchange (true))
    branch->cut ();
}

/* A frame that is on its way into the queue has arrived when its stream lock is
 * free; the queue does not block. */
void
RecordingBranch::cut ()
{
  gst_pad_add_probe (
      entry_.get (),
      GstPadProbeType (
          GST_PAD_PROBE_TYPE_DATA_DOWNSTREAM | GST_PAD_PROBE_TYPE_EVENT_FLUSH),
      [] (GstPad *, GstPadProbeInfo *, gpointer) { return GST_PAD_PROBE_DROP; },
      nullptr, nullptr);
  const ObjectPtr<GstPad> sink (gst_pad_get_peer (entry_.get ()));
  GST_PAD_STREAM_LOCK (sink.get ());
  GST_PAD_STREAM_UNLOCK (sink.get ());
}

/* A sink that has failed would never say that the stream has ended. */
void
RecordingBranch::remove ()
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

} // namespace codedexposure::app

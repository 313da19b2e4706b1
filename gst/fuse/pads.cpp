/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The source pads: requests, releases, events and flow. */
#include "fuse.h"

#include <utility>

#include "common/element.h"
#include "common/tag.h"

GST_DEBUG_CATEGORY_EXTERN (codedexposure_fuse_debug);
#define GST_CAT_DEFAULT codedexposure_fuse_debug

namespace codedexposure::gst::fuse
{

GstPad *
Fuse::request_pad ()
{
  const auto made =
      new_source_pad ("uncertainty", "uncertainty", PadKind::uncertainty);
  GstPad *pad = uncertainty_.add (GST_PAD (made.get ()));
  if (!pad)
    GST_WARNING_OBJECT (element (),
        "pad uncertainty exists; put a tee after it to use it twice");
  return pad;
}

void
Fuse::release_pad (GstPad *pad)
{
  {
    const ObjectLock lock (element ());
    CodedPad &coded = GST_CODED_PAD (pad)->coded;
    if (std::exchange (coded.served, false))
      gst_flow_combiner_remove_pad (combiner_.get (), pad);
    coded.released = true;
  }
  uncertainty_.release (pad);
}

/* The pad, if it was requested and has the events that came before. */
ObjectPtr<GstCodedPad>
Fuse::uncertainty_pad () const
{
  ObjectPtr<GstPad> pad = uncertainty_.get ();
  const ObjectLock lock (element ());
  return ObjectPtr<GstCodedPad> (pad && GST_CODED_PAD (pad.get ())->coded.served
                                     ? GST_CODED_PAD (pad.release ())
                                     : nullptr);
}

void
Fuse::each_pad (const PadVisitor &visit) const
{
  visit (srcpad_.get ());
  if (const auto pad = uncertainty_pad ())
    visit (pad.get ());
}

/* A pad that was requested since the last event or frame gets the events of the
 * other one. On the streaming thread, which is the only one that sends them. */
void
Fuse::serve_requested ()
{
  const ObjectPtr<GstPad> pad = uncertainty_.get ();
  if (!pad || uncertainty_pad ())
    return;
  GstCodedPad *coded = GST_CODED_PAD (pad.get ());
  std::vector<EventPtr> events;
  gst_pad_sticky_events_foreach (
      GST_PAD (srcpad_.get ()),
      [] (GstPad *, GstEvent **event, gpointer to) noexcept -> gboolean {
        static_cast<std::vector<EventPtr> *> (to)->emplace_back (
            gst_event_ref (*event));
        return TRUE;
      },
      &events);
  for (EventPtr &event : events) {
    const GstEventType type = GST_EVENT_TYPE (event.get ());
    if (type == GST_EVENT_STREAM_START)
      event = stream_start_for (coded, event.get ());
    else if (type == GST_EVENT_CAPS)
      event.reset (gst_event_new_caps (caps_for (coded).get ()));
    else if (type == GST_EVENT_TAG && why_not_coded (event.get ()))
      event.reset (
          provenance_to_event (provenance_for (coded, *provenance ())));
    gst_pad_push_event (pad.get (), event.release ());
  }
  const ObjectLock lock (element ());
  if (coded->coded.released)
    return;
  coded->coded.served = true;
  gst_flow_combiner_add_pad (combiner_.get (), pad.get ());
}

gboolean
Fuse::forward (EventPtr event)
{
  if (gst_event_type_get_flags (GST_EVENT_TYPE (event.get ())) &
      GST_EVENT_TYPE_SERIALIZED)
    serve_requested ();
  const auto made = provenance ();
  if (const auto pad = uncertainty_pad ()) {
    const bool start = GST_EVENT_TYPE (event.get ()) == GST_EVENT_STREAM_START;
    EventPtr own = start ? stream_start_for (pad.get (), event.get ())
                         : EventPtr (event_for (pad.get (),
                               gst_event_ref (event.get ()), made.get ()));
    gst_pad_push_event (GST_PAD (pad.get ()), own.release ());
  }
  return gst_pad_push_event (GST_PAD (srcpad_.get ()),
      event_for (srcpad_.get (), event.release (), made.get ()));
}

} // namespace codedexposure::gst::fuse

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* GstCodedFilter: the source pads, always there or requested, and what flows to
 * all of them. */
#include "coded_filter.h"

#include <utility>

#include "base/text.h"
#include "tag.h"

#define GST_CAT_DEFAULT coded_filter_debug

namespace codedexposure::gst
{

namespace
{

struct Replay {
  GstCodedPad *pad;
  const PadCaps &caps;
  const Provenance *provenance;
  bool tagged = false;
};

/* The number in @name, or the lowest free one if no name is given; -1 if the
 * name is not valid. */
int
index_in (const gchar *name, PadKind kind, const PadMap &taken)
{
  const std::string prefix = prefix_of (kind);
  if (!name || prefix + "%u" == name) {
    int index = 0;
    while (taken.contains ({kind, index}))
      index++;
    return index;
  }
  if (!g_str_has_prefix (name, prefix.c_str ()))
    return -1;
  return parse_int (name + prefix.size ()).value_or (-1);
}

} // namespace

std::shared_ptr<const PadMap>
CodedFilter::pads () const
{
  const ObjectLock lock (element_);
  return pads_;
}

void
CodedFilter::each_pad (const PadVisitor &visit) const
{
  for (const auto served = pads (); const auto &[key, pad] : *served)
    visit (pad.get ());
}

CapsPtr
CodedFilter::caps_for (const GstCodedPad *pad) const
{
  const ObjectLock lock (element_);
  GstCaps *caps = caps_.of (pad->state);
  return CapsPtr (caps ? gst_caps_ref (caps) : nullptr);
}

/* ------------------------------------------------- requests and releases -- */

GstCodedPad *
CodedFilter::add_pad (
    const char *templ, PadKind kind, const std::string &name, int index)
{
  GstPad *pad = gst_pad_new_from_template (
      gst_element_get_pad_template (element_, templ), name.c_str ());
  gst_pad_set_event_function (
      pad, [] (GstPad *self, GstObject *parent, GstEvent *event) noexcept {
        return filter_of (parent).src_event (as<GstCodedPad> (self), event);
      });
  gst_pad_set_query_function (
      pad, [] (GstPad *self, GstObject *parent, GstQuery *query) noexcept {
        return filter_of (parent).src_query (as<GstCodedPad> (self), query);
      });
  GST_PAD_SET_ACCEPT_TEMPLATE (pad);
  CodedPad &coded = as<GstCodedPad> (pad)->state;
  coded.kind = kind;
  coded.index = index;
  gst_pad_set_active (pad, TRUE);
  insert_pad (
      PadRef (as<GstCodedPad> (gst_object_ref_sink (pad)), ObjectUnref ()));
  gst_element_add_pad (element_, pad);
  return as<GstCodedPad> (pad);
}

/* Before the source pads have caps, they have only STREAM_START; all other
 * events wait and reach the new pad together with the others. */
gboolean
CodedFilter::replay_sticky (GstPad *, GstEvent **upstream, gpointer user_data)
{
  auto &[pad, caps, provenance, tagged] = *static_cast<Replay *> (user_data);
  const GstEventType type = GST_EVENT_TYPE (*upstream);
  if (type == GST_EVENT_EOS ||
      (caps.empty () && type != GST_EVENT_STREAM_START))
    return TRUE;
  EventPtr event;
  if (type == GST_EVENT_STREAM_START) {
    event = stream_start_for (pad, *upstream);
  } else if (type != GST_EVENT_CAPS) {
    event.reset (event_for (pad, gst_event_ref (*upstream), provenance));
    tagged |= type == GST_EVENT_TAG;
  } else if (GstCaps *own = caps.of (pad->state)) {
    event.reset (gst_event_new_caps (own));
    gst_event_set_seqnum (event.get (), gst_event_get_seqnum (*upstream));
  }
  if (event)
    gst_pad_store_sticky_event (GST_PAD (pad), event.get ());
  return TRUE;
}

/* Adds @pad to the map and gives it the sticky events of the others. No event
 * is missed: both happen under one lock, and forward () stores an event on the
 * sink pad before it reads the map. */
void
CodedFilter::insert_pad (PadRef pad)
{
  const PadKind kind = pad->state.kind;
  const ObjectLock lock (element_);
  const Provenance *made = shared_.provenance.get ();
  Replay replay{pad.get (), caps_, made};
  gst_pad_sticky_events_foreach (sinkpad_, replay_sticky, &replay);
  if (!caps_.empty () && made && !replay.tagged && kind != PadKind::coded) {
    const EventPtr own (
        provenance_to_event (provenance_for (pad.get (), *made)));
    gst_pad_store_sticky_event (GST_PAD (pad.get ()), own.get ());
  }
  if (const EventPtr eos (gst_event_new_eos ()); ended_)
    gst_pad_store_sticky_event (GST_PAD (pad.get ()), eos.get ());
  gst_flow_combiner_add_pad (combiner_.get (), GST_PAD (pad.get ()));
  auto changed = std::make_shared<PadMap> (*pads_);
  changed->emplace (std::pair (kind, pad->state.index), pad);
  pads_ = std::move (changed);
}

GstPad *
CodedFilter::request_pad (GstPadTemplate *templ, const gchar *name)
{
  const std::string given = GST_PAD_TEMPLATE_NAME_TEMPLATE (templ);
  const PadKind kind = kind_of_template (given);
  const auto present = pads ();
  int index = -1;
  std::string own_name = given;
  if (given.ends_with ("%u")) {
    index = index_in (name, kind, *present);
    if (!allows_pad (kind, index))
      return nullptr;
    own_name = prefix_of (kind) + std::to_string (index);
  }
  if (!present->contains ({kind, index}))
    return GST_PAD (add_pad (given.c_str (), kind, own_name, index));
  GST_WARNING_OBJECT (element_,
      "pad %s exists; put a tee after it to use it twice", own_name.c_str ());
  return nullptr;
}

PadRef
CodedFilter::take_pad (GstPad *pad)
{
  const CodedPad &coded = as<GstCodedPad> (pad)->state;
  const ObjectLock lock (element_);
  auto changed = std::make_shared<PadMap> (*pads_);
  const auto found = changed->find ({coded.kind, coded.index});
  if (found == changed->end () || GST_PAD (found->second.get ()) != pad)
    return nullptr;
  PadRef taken = std::move (found->second);
  taken->state.released = true;
  changed->erase (found);
  pads_ = std::move (changed);
  gst_flow_combiner_remove_pad (combiner_.get (), pad);
  return taken;
}

void
CodedFilter::release_pad (GstPad *pad)
{
  if (const PadRef taken = take_pad (pad)) {
    gst_pad_set_active (pad, FALSE);
    gst_element_remove_pad (element_, pad);
  }
}

/* ---------------------------------------------------------------- events -- */

Provenance
CodedFilter::provenance_for (const GstCodedPad *pad, Provenance made)
{
  if (pad->state.kind == PadKind::uncertainty) {
    made.method += kUncertaintyMethod;
    made.setup.bits = 0;
  }
  return made;
}

GstEvent *
CodedFilter::event_for (
    const GstCodedPad *pad, GstEvent *event, const Provenance *provenance)
{
  if (GST_EVENT_TYPE (event) != GST_EVENT_TAG ||
      pad->state.kind == PadKind::coded || !provenance)
    return event;
  return replace_by_provenance (event, provenance_for (pad, *provenance));
}

/* GStreamer stores a sticky event on the sink pad after its handler has
 * returned, which is too late for insert_pad (). EOS can be stored only once,
 * so it is left to GStreamer. */
gboolean
CodedFilter::forward (EventPtr event)
{
  const GstEventType type = GST_EVENT_TYPE (event.get ());
  if (gst_event_type_get_flags (type) & GST_EVENT_TYPE_STICKY &&
      type != GST_EVENT_EOS)
    gst_pad_store_sticky_event (sinkpad_, event.get ());
  if (type == GST_EVENT_EOS || type == GST_EVENT_STREAM_START ||
      type == GST_EVENT_FLUSH_STOP) {
    const ObjectLock lock (element_);
    ended_ = type == GST_EVENT_EOS;
  }
  const auto made = provenance ();
  each_pad ([&] (GstCodedPad *pad) {
    EventPtr own =
        type == GST_EVENT_STREAM_START ? stream_start_for (pad, event.get ())
        : type == GST_EVENT_GAP && pad->state.kind != PadKind::coded
            ? gap_for (pad, event.get ())
            : EventPtr (
                  event_for (pad, gst_event_ref (event.get ()), made.get ()));
    gst_pad_push_event (GST_PAD (pad), own.release ());
  });
  return TRUE;
}

} // namespace codedexposure::gst

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The source pads: requests, releases, events and flow. */
#include "demux.h"

#include <algorithm>
#include <utility>

#include "base/text.h"
#include "common/element.h"
#include "common/tag.h"

GST_DEBUG_CATEGORY_EXTERN (codedexposure_demux_debug);
#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace codedexposure::gst::demux
{

namespace
{

struct Replay {
  GstCodedPad *pad;
  const PadCaps &caps;
  const Provenance *provenance;
  bool tagged = false;
};

/* Before the source pads have caps, they have only STREAM_START; all other
 * events wait and reach the new pad together with the others. */
gboolean
replay_sticky (GstPad *, GstEvent **upstream, gpointer user_data)
{
  auto &[pad, caps, provenance, tagged] = *static_cast<Replay *> (user_data);
  const GstEventType type = GST_EVENT_TYPE (*upstream);
  if (type == GST_EVENT_EOS || (!caps && type != GST_EVENT_STREAM_START))
    return TRUE;
  EventPtr event;
  if (type == GST_EVENT_STREAM_START) {
    event = stream_start_for (pad, *upstream);
  } else if (type != GST_EVENT_CAPS) {
    event.reset (Demux::event_for (pad, gst_event_ref (*upstream), provenance));
    tagged |= type == GST_EVENT_TAG;
  } else if (GstCaps *own = caps.of (pad->coded)) {
    event.reset (gst_event_new_caps (own));
    gst_event_set_seqnum (event.get (), gst_event_get_seqnum (*upstream));
  }
  if (event)
    gst_pad_store_sticky_event (GST_PAD (pad), event.get ());
  return TRUE;
}

/* Names of numbered pads begin with it; in the name of the template, "%u"
 * follows. */
const char *
prefix_of (PadKind kind)
{
  return kind == PadKind::region ? "region_" : "subframe_";
}

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

GstCodedPad *
find_pad (const PadMap &pads, PadKind kind, int index)
{
  const auto found = pads.find ({kind, index});
  return found == pads.end () ? nullptr : found->second.get ();
}

std::shared_ptr<const PadMap>
Demux::pads () const
{
  const ObjectLock lock (element ());
  return pads_;
}

void
Demux::each_pad (const PadVisitor &visit) const
{
  for (const auto served = pads (); const auto &[key, pad] : *served)
    visit (pad.get ());
}

ObjectPtr<GstPad>
Demux::coded_pad () const
{
  const auto served = pads ();
  GstCodedPad *pad = find_pad (*served, PadKind::coded);
  return ObjectPtr<GstPad> (pad ? GST_PAD (gst_object_ref (pad)) : nullptr);
}

/* ------------------------------------------------- requests and releases -- */

int
numbered_pads (PadKind kind, const Schedule *schedule)
{
  if (kind == PadKind::region)
    return schedule ? int (schedule->regions ().size ())
                    : Schedule::kMaxRegions;
  return schedule ? schedule->elements () : Tile::kMaxElements;
}

std::string
pads_text (PadKind kind, const Schedule *schedule)
{
  const int n = numbered_pads (kind, schedule);
  const std::string prefix = prefix_of (kind);
  const std::string owner =
      schedule ? schedule->text () : "the largest schedule";
  if (n == 0)
    return owner + " has no regions.";
  return owner + " has " + prefix + "0" +
         (n > 1 ? " to " + prefix + std::to_string (n - 1) : "") + ".";
}

/* Before a schedule is in force, any number that a schedule can have is
 * allowed; check_pads () checks again. */
bool
Demux::index_allowed (PadKind kind, int index) const
{
  ScheduleRef schedule;
  {
    const ObjectLock lock (element ());
    schedule = shared_.schedule;
  }
  if (index >= 0 && index < numbered_pads (kind, schedule.get ()))
    return true;
  POST_WARNING (element (), STREAM, WRONG_TYPE,
      "There is no pad " + (prefix_of (kind) + std::to_string (index)) + ": " +
          pads_text (kind, schedule.get ()));
  return false;
}

/* Whether the schedule has a subframe or a region for each of @pads. */
bool
Demux::check_pads (const PadMap &pads) const
{
  const Schedule &schedule = format ().schedule;
  for (const PadKind kind : {PadKind::one, PadKind::region}) {
    const auto beyond =
        pads.lower_bound ({kind, numbered_pads (kind, &schedule)});
    if (beyond == pads.end () || beyond->first.first != kind)
      continue;
    post_error ("Pad " +
                (prefix_of (kind) + std::to_string (beyond->first.second)) +
                " was requested, but " + pads_text (kind, &schedule));
    return false;
  }
  return true;
}

GstCodedPad *
Demux::add_pad (
    const char *templ, PadKind kind, const std::string &name, int index)
{
  const PadRef pad (
      new_source_pad (templ, name, kind, index).release (), ObjectUnref ());
  gst_pad_set_active (GST_PAD (pad.get ()), TRUE);
  insert_pad (pad);
  gst_element_add_pad (element (), GST_PAD (pad.get ()));
  return pad.get ();
}

/* Adds @pad to the map and gives it the sticky events of the others. No event
 * is missed: both happen under one lock, and forward () stores an event on the
 * sink pad before it reads the map. */
void
Demux::insert_pad (PadRef pad)
{
  const PadKind kind = pad->coded.kind;
  const ObjectLock lock (element ());
  Replay replay{pad.get (), caps_, shared_.provenance.get ()};
  gst_pad_sticky_events_foreach (sinkpad (), replay_sticky, &replay);
  if (caps_ && shared_.provenance && !replay.tagged && kind != PadKind::coded) {
    const EventPtr made (provenance_to_event (*shared_.provenance));
    gst_pad_store_sticky_event (GST_PAD (pad.get ()), made.get ());
  }
  if (const EventPtr eos (gst_event_new_eos ()); ended_)
    gst_pad_store_sticky_event (GST_PAD (pad.get ()), eos.get ());
  gst_flow_combiner_add_pad (combiner_.get (), GST_PAD (pad.get ()));
  auto changed = std::make_shared<PadMap> (*pads_);
  changed->emplace (std::pair (pad->coded.kind, pad->coded.index), pad);
  pads_ = std::move (changed);
}

GstPad *
Demux::request_pad (GstPadTemplate *templ, const gchar *name)
{
  const std::string kind_name = GST_PAD_TEMPLATE_NAME_TEMPLATE (templ);
  const auto present = pads ();
  PadKind kind = PadKind::coded;
  int index = -1;
  std::string own_name = kind_name;
  if (kind_name != "coded") {
    kind = kind_name == "region_%u" ? PadKind::region : PadKind::one;
    index = index_in (name, kind, *present);
    if (!index_allowed (kind, index))
      return nullptr;
    own_name = prefix_of (kind) + std::to_string (index);
  }
  if (present->contains ({kind, index})) {
    GST_WARNING_OBJECT (element (),
        "pad %s exists; put a tee after it to use it twice", own_name.c_str ());
    return nullptr;
  }
  return GST_PAD (add_pad (kind_name.c_str (), kind, own_name, index));
}

PadRef
Demux::take_pad (GstPad *pad)
{
  const CodedPad &coded = GST_CODED_PAD (pad)->coded;
  const ObjectLock lock (element ());
  auto changed = std::make_shared<PadMap> (*pads_);
  const auto found = changed->find ({coded.kind, coded.index});
  if (found == changed->end () || GST_PAD (found->second.get ()) != pad)
    return nullptr;
  PadRef taken = std::move (found->second);
  taken->coded.released = true;
  changed->erase (found);
  pads_ = std::move (changed);
  gst_flow_combiner_remove_pad (combiner_.get (), pad);
  return taken;
}

void
Demux::release_pad (GstPad *pad)
{
  if (const PadRef taken = take_pad (pad)) {
    gst_pad_set_active (pad, FALSE);
    gst_element_remove_pad (element (), pad);
  }
}

/* ------------------------------------------------------- events and flow -- */

/* Subframe k alone is pushed at the time of its slot, and so is what replaces
 * it. */
EventPtr
Demux::gap_for (const GstCodedPad *pad, GstEvent *gap) const
{
  const auto k = std::size_t (pad->coded.index);
  if (pad->coded.kind != PadKind::one || !plan_ ||
      k >= plan_->background ().boundaries.size ())
    return EventPtr (gst_event_ref (gap));
  GstClockTime pts, duration;
  GstGapFlags flags;
  gst_event_parse_gap (gap, &pts, &duration);
  gst_event_parse_gap_flags (gap, &flags);
  EventPtr own (gst_event_new_gap (
      pts + GstClockTime (plan_->background ().boundaries[k]), duration));
  gst_event_set_gap_flags (own.get (), flags);
  gst_event_set_seqnum (own.get (), gst_event_get_seqnum (gap));
  return own;
}

/* GStreamer stores a sticky event on the sink pad after its handler has
 * returned, which is too late for insert_pad (). EOS can be stored only once,
 * so it is left to GStreamer. */
gboolean
Demux::forward (EventPtr event)
{
  const GstEventType type = GST_EVENT_TYPE (event.get ());
  if (gst_event_type_get_flags (type) & GST_EVENT_TYPE_STICKY &&
      type != GST_EVENT_EOS)
    gst_pad_store_sticky_event (sinkpad (), event.get ());
  if (type == GST_EVENT_EOS || type == GST_EVENT_STREAM_START ||
      type == GST_EVENT_FLUSH_STOP) {
    const ObjectLock lock (element ());
    ended_ = type == GST_EVENT_EOS;
  }
  const auto made = provenance ();
  each_pad ([&] (GstCodedPad *pad) {
    EventPtr own =
        type == GST_EVENT_STREAM_START ? stream_start_for (pad, event.get ())
        : type == GST_EVENT_GAP
            ? gap_for (pad, event.get ())
            : EventPtr (
                  event_for (pad, gst_event_ref (event.get ()), made.get ()));
    gst_pad_push_event (GST_PAD (pad), own.release ());
  });
  return TRUE;
}

void
Demux::flushed ()
{
  live_.reset ();
}

} // namespace codedexposure::gst::demux

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The source pads: asked for, given back, and told of events. */
#include "base/text.h"
#include "gstcodedexposuredemuxstate.h"

#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace cexp::gst::demux
{

namespace
{

bool
is_sticky (const GstEvent *event)
{
  return gst_event_type_get_flags (GST_EVENT_TYPE (event)) &
         GST_EVENT_TYPE_STICKY;
}

GstIterator *
internal_links (GstPad *, GstObject *parent)
{
  const DemuxState &st = state (GST_CODED_EXPOSURE_DEMUX (parent));
  GValue sink = G_VALUE_INIT;
  g_value_init (&sink, GST_TYPE_PAD);
  g_value_set_object (&sink, st.sinkpad);
  GstIterator *links = gst_iterator_new_single (GST_TYPE_PAD, &sink);
  g_value_unset (&sink);
  return links;
}

/* gst_pad_create_stream_id () needs the sink pad's sticky event, which is
 * stored only after its handler has returned. */
EventPtr
stream_start_for (GstPad *pad, GstEvent *upstream)
{
  const gchar *id = nullptr;
  gst_event_parse_stream_start (upstream, &id);
  const CharPtr name (gst_pad_get_name (pad));
  const std::string own = std::string (id) + "/" + name.get ();

  EventPtr event (gst_event_new_stream_start (own.c_str ()));
  gst_event_set_seqnum (event.get (), gst_event_get_seqnum (upstream));
  GstStreamFlags flags = GST_STREAM_FLAG_NONE;
  gst_event_parse_stream_flags (upstream, &flags);
  gst_event_set_stream_flags (event.get (), flags);
  guint group = GST_GROUP_ID_INVALID;
  if (gst_event_parse_group_id (upstream, &group))
    gst_event_set_group_id (event.get (), group);
  return event;
}

/* The upstream event as @output shows it; null for one that is not shown. */
EventPtr
translate (const Output &output, const PadCaps &caps, GstEvent *upstream)
{
  switch (GST_EVENT_TYPE (upstream)) {
  case GST_EVENT_STREAM_START:
    return stream_start_for (output.pad.get (), upstream);
  case GST_EVENT_CAPS: {
    GstCaps *own = caps.of (output);
    if (!own)
      return nullptr;
    EventPtr event (gst_event_new_caps (own));
    gst_event_set_seqnum (event.get (), gst_event_get_seqnum (upstream));
    return event;
  }
  default:
    return EventPtr (gst_event_ref (upstream));
  }
}

struct Replay {
  const Output &output;
  const PadCaps &caps;
};

/* Before the source pads have caps, only the start of the stream has passed
 * them; everything else waits and comes to the new pad with the others. */
gboolean
replay_sticky (GstPad *, GstEvent **event, gpointer user_data)
{
  const auto &replay = *static_cast<const Replay *> (user_data);
  const GstEventType type = GST_EVENT_TYPE (*event);
  if (type == GST_EVENT_EOS || (!replay.caps && type != GST_EVENT_STREAM_START))
    return TRUE;
  const EventPtr own = translate (replay.output, replay.caps, *event);
  if (own)
    gst_pad_store_sticky_event (replay.output.pad.get (), own.get ());
  return TRUE;
}

/* Lists @output and gives it what the others were told. Both under one lock,
 * and forward () stores an event on the sink pad before it reads the list: an
 * event that comes meanwhile reaches the pad by one way or the other. */
void
enlist (GstCodedExposureDemux *self, const OutputRef &output)
{
  DemuxState &st = state (self);
  const ObjectLock lock (self);
  Replay replay{*output, st.caps};
  gst_pad_sticky_events_foreach (st.sinkpad, replay_sticky, &replay);
  if (const EventPtr eos (gst_event_new_eos ()); st.ended)
    gst_pad_store_sticky_event (output->pad.get (), eos.get ());

  auto list = std::make_shared<Outputs> (*st.outputs);
  switch (output->kind) {
  case Output::Kind::kAll:
    list->all = output;
    break;
  case Output::Kind::kCoded:
    list->coded = output;
    break;
  default:
    list->numbered (output->kind)[output->index] = output;
  }
  st.outputs = std::move (list);
  gst_flow_combiner_add_pad (st.combiner.get (), output->pad.get ());
}

OutputRef
strike (GstCodedExposureDemux *self, GstPad *pad)
{
  DemuxState &st = state (self);
  const ObjectLock lock (self);
  OutputRef found;
  st.outputs->each ([&] (const OutputRef &output) {
    if (output->pad.get () == pad)
      found = output;
  });
  if (!found)
    return nullptr;
  found->released = true;
  auto list = std::make_shared<Outputs> (*st.outputs);
  if (found->kind == Output::Kind::kCoded)
    list->coded.reset ();
  else
    list->numbered (found->kind).erase (found->index);
  st.outputs = std::move (list);
  gst_flow_combiner_remove_pad (st.combiner.get (), pad);
  return found;
}

/* Of pads that have a number; the template has the same and "%u". */
const char *
prefix_of (Output::Kind kind)
{
  return kind == Output::Kind::kRegion ? "region_" : "subframe_";
}

/* The number in @name, or the lowest free one where no name is given; -1 when
 * the name is none. */
int
index_in (const gchar *name, const std::string &prefix,
    const std::map<int, OutputRef> &taken)
{
  if (!name || prefix + "%u" == name) {
    int index = 0;
    while (taken.count (index) > 0)
      index++;
    return index;
  }
  if (!g_str_has_prefix (name, prefix.c_str ()))
    return -1;
  return parse_int (name + prefix.size ()).value_or (-1);
}

/* While a schedule is in force its range is known; before, the largest there
 * can be, and negotiate () looks again. */
bool
index_allowed (GstCodedExposureDemux *self, Output::Kind kind, int index)
{
  ScheduleRef schedule;
  {
    const ObjectLock lock (self);
    schedule = state (self).in_force;
  }
  if (index >= 0 && index < numbered_pads (kind, schedule.get ()))
    return true;
  GST_ELEMENT_WARNING (self, STREAM, WRONG_TYPE,
      ("There is no pad %s%d: %s", prefix_of (kind), index,
          pads_text (kind, schedule.get ()).c_str ()),
      (nullptr));
  return false;
}

} // namespace

int
numbered_pads (Output::Kind kind, const Schedule *schedule)
{
  if (kind == Output::Kind::kRegion)
    return schedule ? int (schedule->regions ().size ())
                    : Schedule::kMaxRegions;
  return schedule ? schedule->elements () : Tile::kMaxElements;
}

std::string
pads_text (Output::Kind kind, const Schedule *schedule)
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

OutputRef
add_output (GstCodedExposureDemux *self, GstPadTemplate *templ,
    Output::Kind kind, int index)
{
  const CharPtr name (index >= 0
                          ? g_strdup_printf ("%s%d", prefix_of (kind), index)
                          : g_strdup (GST_PAD_TEMPLATE_NAME_TEMPLATE (templ)));
  auto output = std::make_shared<Output> ();
  output->kind = kind;
  output->index = index;
  GstPad *pad = gst_pad_new_from_template (templ, name.get ());
  output->pad.reset (GST_PAD (gst_object_ref_sink (pad)));
  gst_pad_set_event_function (pad, GST_DEBUG_FUNCPTR (src_event));
  gst_pad_set_query_function (pad, GST_DEBUG_FUNCPTR (src_query));
  gst_pad_set_iterate_internal_links_function (
      pad, GST_DEBUG_FUNCPTR (internal_links));
  GST_PAD_SET_ACCEPT_TEMPLATE (pad);

  gst_pad_set_active (pad, TRUE);
  enlist (self, output);
  gst_element_add_pad (GST_ELEMENT (self), pad);
  return output;
}

GstPad *
request_pad (GstElement *element, GstPadTemplate *templ, const gchar *name,
    const GstCaps *) noexcept
{
  auto *self = GST_CODED_EXPOSURE_DEMUX (element);
  const auto list = outputs (self);
  if (g_str_equal (GST_PAD_TEMPLATE_NAME_TEMPLATE (templ), "coded")) {
    if (list->coded) {
      GST_WARNING_OBJECT (self, "pad coded exists: tee it to use it twice");
      return nullptr;
    }
    return add_output (self, templ, Output::Kind::kCoded, -1)->pad.get ();
  }

  const auto kind =
      g_str_equal (GST_PAD_TEMPLATE_NAME_TEMPLATE (templ), "region_%u")
          ? Output::Kind::kRegion
          : Output::Kind::kOne;
  Outputs listed = *list;
  const int index = index_in (name, prefix_of (kind), listed.numbered (kind));
  if (!index_allowed (self, kind, index))
    return nullptr;
  if (listed.numbered (kind).count (index) > 0) {
    GST_WARNING_OBJECT (self, "pad %s%d exists: tee it to use it twice",
        prefix_of (kind), index);
    return nullptr;
  }
  return add_output (self, templ, kind, index)->pad.get ();
}

void
release_pad (GstElement *element, GstPad *pad) noexcept
{
  const OutputRef output = strike (GST_CODED_EXPOSURE_DEMUX (element), pad);
  if (!output)
    return;
  gst_pad_set_active (pad, FALSE);
  gst_element_remove_pad (element, pad);
}

/* A blocked pad has a probe that waits for data. */
bool
is_wanted (const Output &output)
{
  return gst_pad_is_linked (output.pad.get ()) ||
         gst_pad_is_blocked (output.pad.get ());
}

/* Core stores a sticky event on the sink pad when its handler has returned,
 * which would be too late for enlist (); EOS it stores only once. */
gboolean
forward (GstCodedExposureDemux *self, EventPtr event)
{
  DemuxState &st = state (self);
  const GstEventType type = GST_EVENT_TYPE (event.get ());
  if (is_sticky (event.get ()) && type != GST_EVENT_EOS)
    gst_pad_store_sticky_event (st.sinkpad, event.get ());
  if (type == GST_EVENT_EOS || type == GST_EVENT_STREAM_START ||
      type == GST_EVENT_FLUSH_STOP) {
    const ObjectLock lock (self);
    st.ended = type == GST_EVENT_EOS;
  }
  const PadCaps none;
  outputs (self)->each ([&] (const OutputRef &output) {
    gst_pad_push_event (
        output->pad.get (), translate (*output, none, event.get ()).release ());
  });
  return TRUE;
}

CapsPtr
caps_for (GstCodedExposureDemux *self, const Output &output)
{
  const ObjectLock lock (self);
  GstCaps *caps = state (self).caps.of (output);
  return CapsPtr (caps ? gst_caps_ref (caps) : nullptr);
}

void
push_caps (GstCodedExposureDemux *self, const Output &output)
{
  const CapsPtr caps = caps_for (self, output);
  const CapsPtr current (gst_pad_get_current_caps (output.pad.get ()));
  if (!caps)
    return;
  if (current && gst_caps_is_equal (current.get (), caps.get ()))
    return;
  GstEvent *event = gst_event_new_caps (caps.get ());
  gst_event_set_seqnum (event, state (self).stream.caps_seqnum);
  gst_pad_push_event (output.pad.get (), event);
}

GstFlowReturn
combine_flow (
    GstCodedExposureDemux *self, const Output &output, GstFlowReturn flow)
{
  const ObjectLock lock (self);
  if (flow == GST_FLOW_OK && output.kind != Output::Kind::kCoded)
    state (self).counters.subframes_out++;
  if (output.released)
    return GST_FLOW_OK;
  return gst_flow_combiner_update_pad_flow (
      state (self).combiner.get (), output.pad.get (), flow);
}

void
forget_flow (GstCodedExposureDemux *self)
{
  const ObjectLock lock (self);
  gst_flow_combiner_reset (state (self).combiner.get ());
}

} // namespace cexp::gst::demux

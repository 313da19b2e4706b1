/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-pair: events and queries. */
#include <string>
#include <utility>
#include <vector>

#include "common/caps.h"
#include "common/events.h"
#include "common/tag.h"
#include "pair/pair.h"

namespace codedexposure::gst::pairs
{

namespace
{

/* Returns false. */
bool
refuse (GstCodedExposurePair *self, const std::string &why)
{
  POST_ERROR (self, STREAM, WRONG_TYPE, why);
  state (self).refused = true;
  return false;
}

/* In the words of the program and of launch lines. */
const char *
frames_of (bool on)
{
  return on ? " of the first camera (pad on)"
            : " of the second camera (pad off)";
}

/* The frames of a pad are of the other beam. */
bool
refuse_beam (GstCodedExposurePair *self, bool on)
{
  return refuse (self, std::string ("The frames") + frames_of (on) +
                           " are of the beam of the mirrors that are " +
                           (on ? "off" : "on") + ". Link them to pad " +
                           (on ? "off" : "on") + ", or " + kDecodeTwo);
}

bool
take_caps (GstCodedExposurePair *self, bool on, GstCaps *caps)
{
  PairState &st = state (self);
  PairStream &stream = on ? st.on : st.off;
  if (!gst_video_info_from_caps (&stream.info, caps))
    return false;
  stream.caps.reset (gst_caps_ref (caps));
  st.set_due ();
  if (!on)
    return true;
  st.has_begun = false;
  gst_pad_mark_reconfigure (GST_AGGREGATOR_SRC_PAD (self));
  if (stream.info.fps_n > 0) {
    const GstClockTime wait = gst_util_uint64_scale (
        GST_SECOND, stream.info.fps_d, 4 * guint64 (stream.info.fps_n));
    gst_aggregator_set_latency (GST_AGGREGATOR (self), wait, wait);
  }
  return true;
}

/* In the order of the frames of a pad. False if they are refused. */
bool
follow (GstCodedExposurePair *self, bool on, GstEvent *event)
{
  PairState &st = state (self);
  PairStream &stream = on ? st.on : st.off;
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_STREAM_START:
    stream.setup.reset ();
    break;
  case GST_EVENT_CAPS:
    return take_caps (self, on, caps_of (event));
  case GST_EVENT_SEGMENT:
    st.refused |= !counts_time (self, *segment_of (event));
    if (st.refused || !on)
      return !st.refused;
    st.has_begun = false;
    gst_aggregator_update_segment (GST_AGGREGATOR (self), segment_of (event));
    break;
  case GST_EVENT_TAG:
    if (const auto why = why_not_coded (event, frames_of (on)))
      return refuse (self, *why);
    if (const auto setup = setup_from_tags (tags_of (event)); setup && *setup) {
      if (setup->value ().off_beam == on)
        return refuse_beam (self, on);
      stream.setup = setup->value ();
      st.set_due ();
    } else if (on) {
      st.due.emplace_back (gst_event_ref (event));
    }
    break;
  case GST_EVENT_GAP:
    if (on)
      st.due.emplace_back (gst_event_ref (event));
    if (on && st.has_begun)
      push_due (self);
    break;
  default:
    break;
  }
  return true;
}

} // namespace

void
push_due (GstCodedExposurePair *self)
{
  PairState &st = state (self);
  GstPad *pad = GST_AGGREGATOR_SRC_PAD (self);
  /* A gap is in place of a frame, which needs the tag first. */
  if (std::exchange (st.setup_due, false) && st.on.setup) {
    StreamSetup setup = *st.on.setup;
    if (st.off.caps)
      setup.partner = st.off.setup.value_or (StreamSetup ())
                          .as_partner ({st.off.info.width, st.off.info.height});
    gst_pad_push_event (pad, setup_to_event (setup));
  }
  for (EventPtr &event : std::exchange (st.due, {}))
    gst_pad_push_event (pad, event.release ());
}

gboolean
sink_event (GstAggregator *aggregator, GstAggregatorPad *pad, GstEvent *event)
{
  auto *self = as<GstCodedExposurePair> (aggregator);
  const bool on = pad == sink (self, "on");
  if (!follow (self, on, event)) {
    gst_event_unref (event);
    return FALSE;
  }
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_STREAM_START:
  case GST_EVENT_SEGMENT:
  case GST_EVENT_EOS:
  case GST_EVENT_FLUSH_START:
  case GST_EVENT_FLUSH_STOP:
    break;
  default:
    /* Only the first camera's reach downstream. The base class would make
     * frames of gaps. */
    if (on && GST_EVENT_TYPE (event) != GST_EVENT_CAPS &&
        GST_EVENT_TYPE (event) != GST_EVENT_TAG &&
        GST_EVENT_TYPE (event) != GST_EVENT_GAP)
      break;
    gst_event_unref (event);
    return TRUE;
  }
  return parent_class<GstAggregatorClass> (aggregator)
      ->sink_event (aggregator, pad, event);
}

/* The first camera's caps go through; those of the second are free. */
gboolean
sink_query (GstAggregator *aggregator, GstAggregatorPad *pad, GstQuery *query)
{
  if (GST_QUERY_TYPE (query) != GST_QUERY_CAPS ||
      pad != sink (aggregator, "on"))
    return parent_class<GstAggregatorClass> (aggregator)
        ->sink_query (aggregator, pad, query);
  const CapsPtr peer (
      gst_pad_peer_query_caps (GST_AGGREGATOR_SRC_PAD (aggregator), nullptr));
  const CapsPtr own (gst_pad_get_pad_template_caps (GST_PAD (pad)));
  answer_caps (query, intersect_caps (peer.get (), own.get ()));
  return TRUE;
}

/* The dmdsync of the first camera drives the mirrors. */
gboolean
src_event (GstAggregator *aggregator, GstEvent *event)
{
  if (GST_EVENT_TYPE (event) == GST_EVENT_CUSTOM_UPSTREAM)
    return gst_pad_push_event (GST_PAD (sink (aggregator, "on")), event);
  return parent_class<GstAggregatorClass> (aggregator)
      ->src_event (aggregator, event);
}

gboolean
src_query (GstAggregator *aggregator, GstQuery *query)
{
  if (is_query<PairsAnswer> (query)) {
    answer_query (query, PairsAnswer{true});
    return TRUE;
  }
  if (GST_QUERY_TYPE (query) == GST_QUERY_CUSTOM)
    return gst_pad_peer_query (GST_PAD (sink (aggregator, "on")), query);
  return parent_class<GstAggregatorClass> (aggregator)
      ->src_query (aggregator, query);
}

GstFlowReturn
flush (GstAggregator *aggregator)
{
  PairState &st = state (aggregator);
  st.alone.forget ();
  st.refused_in_a_row = 0;
  st.check.reset ();
  st.has_begun = false;
  std::erase_if (st.due, [] (const EventPtr &event) {
    return GST_EVENT_TYPE (event.get ()) == GST_EVENT_GAP;
  });
  return GST_FLOW_OK;
}

} // namespace codedexposure::gst::pairs

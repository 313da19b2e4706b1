/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Answers to the CAPS query: what one side can do, seen from the other. */
#include "gstcodedexposuredemuxstate.h"

#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace cexp::gst::demux
{

namespace
{

/* What answers depend on, at one moment. */
struct Known {
  ScheduleRef schedule; ///< null: any may come
  SaidRate rate;
  bool mapped; ///< frames and subframes can be of any size
};

Known
known (GstCodedExposureDemux *self)
{
  const DemuxState &st = state (self);
  const ObjectLock lock (self);
  return {binding_schedule (st.settings, st.in_force, st.assumed),
      st.settings.rate, st.settings.mapped || st.rectifies};
}

/* @caps of the pad of region @i, whose size does not follow from that of the
 * frames, as those of coded frames, or the other way. */
CapsPtr
convert_region (const Known &now, int i, GstCaps *caps, bool to_coded)
{
  const Schedule &schedule = *now.schedule;
  if (i >= int (schedule.regions ().size ()))
    return unbind_caps (caps);
  const CapsScale scale = coded_to_subframes (schedule.region (i), true);
  if (to_coded)
    return unbind_size (CapsPtr (scale_caps (caps, scale.inverse ())).get ());
  const Rect &rect = schedule.regions ()[std::size_t (i)].rect;
  const CapsPtr cut (gst_caps_copy (caps));
  gst_caps_set_simple (cut.get (), "width", G_TYPE_INT, rect.width, "height",
      G_TYPE_INT, rect.height, nullptr);
  return CapsPtr (scale_caps (cut.get (), scale));
}

/* @caps of @output as those of coded frames, or the other way. */
CapsPtr
convert (const Known &now, const Output &output, GstCaps *caps, bool to_coded)
{
  if (output.kind == Output::Kind::kCoded)
    return CapsPtr (gst_caps_ref (caps));
  if (!now.schedule)
    return unbind_caps (caps);
  if (output.kind == Output::Kind::kRegion)
    return convert_region (now, output.index, caps, to_coded);
  const CapsScale scale =
      coded_to_subframes (*now.schedule, output.kind == Output::Kind::kAll);
  CapsPtr scaled (scale_caps (caps, to_coded ? scale.inverse () : scale));
  return now.mapped ? unbind_size (scaled.get ()) : std::move (scaled);
}

} // namespace

/* A pad that is not linked limits nothing: without a peer, ANY comes back. */
GstCaps *
sink_caps (GstCodedExposureDemux *self)
{
  const Known now = known (self);
  CapsPtr caps (gst_pad_get_pad_template_caps (state (self).sinkpad));
  outputs (self)->each ([&] (const OutputRef &output) {
    const CapsPtr peer (gst_pad_peer_query_caps (output->pad.get (), nullptr));
    const CapsPtr coded = convert (now, *output, peer.get (), true);
    caps = intersect_caps (coded.get (), caps.get ());
  });
  return admit_unknown_rate (now.rate, std::move (caps)).release ();
}

GstCaps *
src_caps (GstCodedExposureDemux *self, GstPad *pad)
{
  const Known now = known (self);
  OutputRef output;
  outputs (self)->each ([&] (const OutputRef &candidate) {
    if (candidate->pad.get () == pad)
      output = candidate;
  });
  const CapsPtr templ (gst_pad_get_pad_template_caps (pad));
  if (!output)
    return gst_caps_ref (templ.get ());

  const CapsPtr peer (gst_pad_peer_query_caps (state (self).sinkpad, nullptr));
  const CapsPtr coded = intersect_caps (peer.get (), templ.get ());
  const CapsPtr filled = fill_in_rate (now.rate, coded.get ());
  const CapsPtr own = convert (now, *output, filled.get (), false);
  return intersect_caps (own.get (), templ.get ()).release ();
}

} // namespace cexp::gst::demux

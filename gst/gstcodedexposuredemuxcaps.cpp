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
  int rate_num, rate_den;
};

/* A schedule that was only assumed binds nobody: the tag may still come. */
Known
known (GstCodedExposureDemux *self)
{
  const DemuxState &st = state (self);
  const ObjectLock lock (self);
  Known now{nullptr, st.settings.rate_num, st.settings.rate_den};
  if (st.settings.parsed && *st.settings.parsed)
    now.schedule =
        ScheduleRef (st.settings.parsed, &st.settings.parsed->value ());
  else if (!st.assumed)
    now.schedule = st.in_force;
  return now;
}

/* @caps without the fields that a schedule changes. */
CapsPtr
unbind (GstCaps *caps)
{
  if (gst_caps_is_any (caps))
    return CapsPtr (gst_caps_ref (caps));
  CapsPtr free (gst_caps_copy (caps));
  for (guint i = 0; i < gst_caps_get_size (free.get ()); i++)
    gst_structure_remove_fields (gst_caps_get_structure (free.get (), i),
        "framerate", "max-framerate", "width", "height", "pixel-aspect-ratio",
        nullptr);
  return free;
}

/* @caps of a pad of @kind as those of coded frames, or the other way. */
CapsPtr
convert (const Known &now, Output::Kind kind, GstCaps *caps, bool to_coded)
{
  if (kind == Output::Kind::kCoded)
    return CapsPtr (gst_caps_ref (caps));
  if (!now.schedule)
    return unbind (caps);
  const CapsScale scale =
      coded_to_subframes (*now.schedule, kind == Output::Kind::kAll);
  return CapsPtr (scale_caps (caps, to_coded ? scale.inverse () : scale));
}

CapsPtr
intersect (GstCaps *preferred, GstCaps *other)
{
  return CapsPtr (
      gst_caps_intersect_full (preferred, other, GST_CAPS_INTERSECT_FIRST));
}

bool
has_rate (const GstStructure *structure)
{
  gint num = 1, den = 1;
  return gst_structure_has_field (structure, "framerate") &&
         !(gst_structure_get_fraction (structure, "framerate", &num, &den) &&
             num == 0);
}

/* Where the user has said the rate, frames whose caps have none do as well. */
CapsPtr
admit_unknown_rate (const Known &now, CapsPtr caps)
{
  if (now.rate_num == 0 || gst_caps_is_any (caps.get ()))
    return caps;
  const CapsPtr said (gst_caps_new_simple ("video/x-raw", "framerate",
      GST_TYPE_FRACTION, now.rate_num, now.rate_den, nullptr));
  const CapsPtr at_rate = intersect (caps.get (), said.get ());
  GstCaps *unknown = gst_caps_copy (at_rate.get ());
  gst_caps_set_simple (unknown, "framerate", GST_TYPE_FRACTION, 0, 1, nullptr);
  return CapsPtr (gst_caps_merge (caps.release (), unknown));
}

CapsPtr
fill_in_rate (const Known &now, GstCaps *caps)
{
  CapsPtr filled (gst_caps_copy (caps));
  for (guint i = 0; i < gst_caps_get_size (filled.get ()); i++) {
    GstStructure *structure = gst_caps_get_structure (filled.get (), i);
    if (now.rate_num > 0 && !has_rate (structure))
      gst_structure_set (structure, "framerate", GST_TYPE_FRACTION,
          now.rate_num, now.rate_den, nullptr);
  }
  return filled;
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
    const CapsPtr coded = convert (now, output->kind, peer.get (), true);
    caps = intersect (coded.get (), caps.get ());
  });
  return admit_unknown_rate (now, std::move (caps)).release ();
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
  const CapsPtr coded = intersect (peer.get (), templ.get ());
  const CapsPtr filled = fill_in_rate (now, coded.get ());
  const CapsPtr own = convert (now, output->kind, filled.get (), false);
  return intersect (own.get (), templ.get ()).release ();
}

} // namespace cexp::gst::demux

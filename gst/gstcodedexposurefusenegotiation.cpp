/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* From caps, schedule and settings to a plan, and caps seen from either side.
 */
#include "gstcodedexposurefusestate.h"

#define GST_CAT_DEFAULT codedexposure_fuse_debug

namespace cexp::gst::fuse
{

namespace
{

/* Rate times N, and the pilot's rows cropped. */
CapsScale
coded_to_fused (const Schedule &schedule)
{
  CapsScale scale;
  scale.rate_num = schedule.slots ();
  scale.crop_rows = schedule.pilot_rows ();
  return scale;
}

/* Pixels are taken to see the mirror of their own place. */
void
warn_of_mapping (GstCodedExposureFuse *self)
{
  Stream &stream = state (self).stream;
  const bool mapped = stream.tagged && *stream.tagged &&
                      stream.tagged->value ().mapping.has_value ();
  if (!mapped || std::exchange (stream.warned_of_mapping, true))
    return;
  GST_ELEMENT_WARNING (self, STREAM, FORMAT,
      ("The stream has a mapping, which fused frames do not follow: they show "
       "the camera's misalignment. Align the camera (moirecalib), or take "
       "subframes (codedexposure-demux)."),
      (nullptr));
}

template <typename Pixel>
Result<AnyFuser>
make_fuser (const Schedule &schedule, const GstVideoInfo &info,
    const FuseOptions &options)
{
  auto made = Fuser<Pixel>::make (schedule, info.width, info.height, options);
  if (!made)
    return made.error ();
  return AnyFuser (std::move (*made));
}

PoolPtr
make_pool (GstCaps *caps, const GstVideoInfo &info)
{
  PoolPtr pool (gst_video_buffer_pool_new ());
  GstStructure *config = gst_buffer_pool_get_config (pool.get ());
  gst_buffer_pool_config_set_params (
      config, caps, guint (GST_VIDEO_INFO_SIZE (&info)), 0, 0);
  if (!gst_buffer_pool_set_config (pool.get (), config) ||
      !gst_buffer_pool_set_active (pool.get (), TRUE))
    return nullptr;
  return pool;
}

struct Proposal {
  Plan plan;
  CapsPtr caps;
  bool assumed;
};

std::optional<Proposal>
propose (GstCodedExposureFuse *self)
{
  GstElement *element = GST_ELEMENT (self);
  Stream &stream = state (self).stream;
  const auto format = find_format (element, stream, stream.settings);
  const auto found =
      format ? find_schedule (element, stream, stream.settings) : std::nullopt;
  if (!found)
    return std::nullopt;
  const Schedule &schedule = found->schedule;
  const GstVideoInfo &info = format->info;
  const FrameRate rate{info.fps_n, info.fps_d};
  const auto slots =
      SlotPlan::fit (schedule.timing (), schedule.slots (), rate);
  if (!slots) {
    refuse (element, slots.error ().message);
    return std::nullopt;
  }
  FuseOptions options = stream.settings.options;
  options.bits = stream.bits_in_force ();
  auto fuser = GST_VIDEO_INFO_FORMAT (&info) == GST_VIDEO_FORMAT_GRAY8
                   ? make_fuser<std::uint8_t> (schedule, info, options)
                   : make_fuser<std::uint16_t> (schedule, info, options);
  if (!fuser) {
    refuse (element, fuser.error ().message);
    return std::nullopt;
  }

  CapsPtr caps (scale_caps (format->caps.get (), coded_to_fused (schedule)));
  GstVideoInfo fused;
  gst_video_info_from_caps (&fused, caps.get ());
  PoolPtr pool = make_pool (caps.get (), fused);
  if (!pool) {
    refuse (element, "No buffers for fused frames of " +
                         std::to_string (fused.width) + "x" +
                         std::to_string (fused.height) + " pixels.");
    return std::nullopt;
  }
  return Proposal{Plan{schedule, info, fused, std::move (*fuser), rate, *slots,
                      options.lookahead, std::move (pool)},
      std::move (caps), found->assumed};
}

/* Makes @proposal the plan in force. */
void
install (GstCodedExposureFuse *self, Proposal proposal)
{
  FuseState &st = state (self);
  Stream &stream = st.stream;
  count_at_rate (stream, proposal.plan.rate,
      stream.plan ? std::optional (stream.plan->rate) : std::nullopt);
  stream.plan = std::move (proposal.plan);
  stream.stale = false;
  const Plan &plan = *stream.plan;
  const GstClockTime latency = GstClockTime (plan.lookahead) * plan.period ();
  bool schedule_changed, latency_changed;
  {
    const ObjectLock lock (self);
    schedule_changed = !st.in_force || !(*st.in_force == plan.schedule);
    latency_changed = std::exchange (st.latency, latency) != latency;
    st.in_force = std::make_shared<const Schedule> (plan.schedule);
    st.assumed = proposal.assumed;
  }
  const CapsPtr current (gst_pad_get_current_caps (st.srcpad));
  if (!current || !gst_caps_is_equal (current.get (), proposal.caps.get ()))
    gst_pad_push_event (st.srcpad, gst_event_new_caps (proposal.caps.get ()));
  GST_INFO_OBJECT (self, "%s: %dx%d", plan.schedule.text ().c_str (),
      plan.fused.width, plan.fused.height);
  if (schedule_changed)
    notify (self, "schedule-in-force");
  if (latency_changed)
    gst_element_post_message (
        GST_ELEMENT (self), gst_message_new_latency (GST_OBJECT (self)));
}

/* What answers about caps depend on, at one moment. */
struct Known {
  ScheduleRef schedule; ///< null: any may come
  SaidRate rate;
};

Known
known (GstCodedExposureFuse *self)
{
  const FuseState &st = state (self);
  const ObjectLock lock (self);
  return {binding_schedule (st.settings, st.in_force, st.assumed),
      st.settings.rate};
}

CapsPtr
convert (const Known &now, GstCaps *caps, bool to_coded)
{
  if (!now.schedule)
    return unbind_caps (caps);
  const CapsScale scale = coded_to_fused (*now.schedule);
  return CapsPtr (scale_caps (caps, to_coded ? scale.inverse () : scale));
}

} // namespace

GstFlowReturn
negotiate (GstCodedExposureFuse *self, GstBuffer *next)
{
  FuseState &st = state (self);
  take_bits (st.stream, next);
  {
    const ObjectLock lock (self);
    if (std::exchange (st.settings_changed, false)) {
      st.stream.settings = st.settings;
      st.stream.stale = true;
    }
  }
  if (st.stream.stale) {
    if (const GstFlowReturn flow = drain (self); flow != GST_FLOW_OK)
      return flow;
    auto proposal = propose (self);
    if (!proposal)
      return GST_FLOW_NOT_NEGOTIATED;
    install (self, std::move (*proposal));
    warn_of_mapping (self);
  }
  settle_events (self);
  return GST_FLOW_OK;
}

GstCaps *
sink_caps (GstCodedExposureFuse *self)
{
  const Known now = known (self);
  const CapsPtr templ (gst_pad_get_pad_template_caps (state (self).sinkpad));
  const CapsPtr peer (gst_pad_peer_query_caps (state (self).srcpad, nullptr));
  const CapsPtr coded = convert (now, peer.get (), true);
  return admit_unknown_rate (
      now.rate, intersect_caps (coded.get (), templ.get ()))
      .release ();
}

GstCaps *
src_caps (GstCodedExposureFuse *self)
{
  const Known now = known (self);
  const CapsPtr templ (gst_pad_get_pad_template_caps (state (self).srcpad));
  const CapsPtr peer (gst_pad_peer_query_caps (state (self).sinkpad, nullptr));
  const CapsPtr coded = intersect_caps (peer.get (), templ.get ());
  const CapsPtr filled = fill_in_rate (now.rate, coded.get ());
  const CapsPtr own = convert (now, filled.get (), false);
  return intersect_caps (own.get (), templ.get ()).release ();
}

} // namespace cexp::gst::fuse

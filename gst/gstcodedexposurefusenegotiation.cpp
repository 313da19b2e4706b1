/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* From caps, schedule and settings to a plan, and caps seen from either side.
 */
#include <algorithm>
#include <cmath>

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

/* Noise of an ordinary exposure at a typical light, where the user says what
 * camera it is. */
RectifyOptions
rectify_options (const SensorNoise &noise)
{
  constexpr double kTypicalLight = 0.4;
  RectifyOptions options;
  if (noise.full_well > 0.0)
    options.noise = std::clamp (
        std::sqrt (noise.variance (kTypicalLight * noise.full_well, 0.0)) /
            noise.full_well,
        RectifyOptions::kLeastNoise, RectifyOptions::kMostNoise);
  return options;
}

template <typename Pixel>
Result<AnyFuser>
make_fuser (const Schedule &schedule, Extent size, const FuseOptions &options)
{
  auto made = Fuser<Pixel>::make (schedule, size.width, size.height, options);
  if (!made)
    return made.error ();
  return AnyFuser (std::move (*made));
}

/* For frames of @format that were rectified to @size. */
std::optional<AnyFuser>
make_fuser (GstCodedExposureFuse *self, const Schedule &schedule,
    GstVideoFormat format, Extent size)
{
  const Stream &stream = state (self).stream;
  FuseOptions options = stream.settings.options;
  options.bits = stream.bits_in_force ();
  auto fuser = format == GST_VIDEO_FORMAT_GRAY8
                   ? make_fuser<std::uint8_t> (schedule, size, options)
                   : make_fuser<std::uint16_t> (schedule, size, options);
  if (fuser)
    return std::move (*fuser);
  refuse (GST_ELEMENT (self), fuser.error ().message);
  return std::nullopt;
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
  Extent size{info.width, info.height};
  std::shared_ptr<const Rectifier> rectifier;
  if (!find_rectifier (element, stream, stream.settings, schedule, size,
          rectify_options (stream.settings.options.noise), rectifier))
    return std::nullopt;
  if (rectifier)
    size = rectifier->mirrors ();
  auto fuser = make_fuser (self, schedule, GST_VIDEO_INFO_FORMAT (&info), size);
  if (!fuser)
    return std::nullopt;

  const CapsPtr rectified (rectifier
                               ? resized_caps (*format, size)
                               : CapsPtr (gst_caps_ref (format->caps.get ())));
  CapsPtr caps (scale_caps (rectified.get (), coded_to_fused (schedule)));
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
                      stream.settings.options.lookahead, std::move (pool),
                      std::move (rectifier)},
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
  say_mapping (GST_ELEMENT (self), st.counters, plan.rectifier.get ());
  const GstClockTime latency = GstClockTime (plan.lookahead) * plan.period ();
  bool schedule_changed, latency_changed;
  {
    const ObjectLock lock (self);
    schedule_changed = !st.in_force || !(*st.in_force == plan.schedule);
    latency_changed = std::exchange (st.latency, latency) != latency;
    st.in_force = std::make_shared<const Schedule> (plan.schedule);
    st.assumed = proposal.assumed;
    st.rectifies = plan.rectifier != nullptr;
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
  bool mapped; ///< coded and fused frames can differ in size
};

Known
known (GstCodedExposureFuse *self)
{
  const FuseState &st = state (self);
  const ObjectLock lock (self);
  return {binding_schedule (st.settings, st.in_force, st.assumed),
      st.settings.rate, st.settings.mapped || st.rectifies};
}

CapsPtr
convert (const Known &now, GstCaps *caps, bool to_coded)
{
  if (!now.schedule)
    return unbind_caps (caps);
  const CapsScale scale = coded_to_fused (*now.schedule);
  CapsPtr scaled (scale_caps (caps, to_coded ? scale.inverse () : scale));
  return now.mapped ? unbind_size (scaled.get ()) : std::move (scaled);
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

/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "source.h"

#include <string>

#include "base/text.h"
#include "common/element.h"
#include "common/meta.h"
#include "pipeline/pads.h"

namespace codedexposure::app
{

using namespace gst;

std::string
grey_caps (const SourcePlan &plan, FrameRate rate)
{
  const std::string size =
      plan.size.width > 0 ? ",width=" + std::to_string (plan.size.width) +
                                ",height=" + std::to_string (plan.size.height)
                          : "";
  return std::string ("video/x-raw,format=") +
         (plan.is_deep () ? "GRAY16_LE" : "GRAY8") + size +
         ",framerate=" + rate_text (rate);
}

namespace
{

/* Every frame of the file becomes one slot, so its times are scaled. videorate
 * counts them from 0, and not every file begins at 0. */
Chain
input_scene (Job &job, const SourceOptions &options, const SourcePlan &plan)
{
  const FrameRate to = plan.scene_rate (), from = plan.input_rate;
  const double speed =
      double (to.num) * from.den / (double (to.den) * from.num);
  Chain chain = job.graph.begin ("filesrc", {{"location", *options.input}});
  chain.to ("decodebin")
      .to ("videoconvert")
      .to ("videoscale")
      .to ("identity", {{"single-segment", true}})
      .to ("videorate", {{"rate", speed}})
      .caps (grey_caps (plan, to));
  return chain;
}

/* videotestsrc writes outside of narrower pictures. */
void
check_ball (const SourceOptions &options, const SourcePlan &plan)
{
  constexpr int kDiameter = 40;
  if (options.pattern.value_or ("ball") == "ball" &&
      plan.size.width < kDiameter)
    usage_error ("the ball of --pattern ball is " + std::to_string (kDiameter) +
                 " pixels wide, the pictures are " +
                 std::to_string (plan.size.width) +
                 "; set a larger --size or another --pattern");
}

Chain
scene (
    Job &job, const SourceOptions &options, const SourcePlan &plan, Pace pace)
{
  const std::string caps = grey_caps (plan, plan.scene_rate ());
  if (!options.input && !options.scene) {
    check_ball (options, plan);
    Chain chain = job.graph.begin (
        "videotestsrc", {{"pattern", options.pattern.value_or ("ball")},
                            {"is-live", pace == Pace::live}});
    return chain.caps (caps);
  }
  Chain chain =
      options.input
          ? input_scene (job, options, plan)
          : job.graph.begin ("codedexposure-scene",
                {{"scene", *options.scene}, {"repeat", plan.scene_repeat}});
  if (!options.input)
    chain.caps (caps);
  if (pace == Pace::live)
    chain.to ("clocksync");
  return chain.to ("queue");
}

/* A camera that is not told how long to expose does what it was last set to.
 * The first frame, in whose exposure not all slots lie, is an error. It says
 * its exposure itself: asking the camera would hold it up. */
GstPadProbeReturn
check_first_frame (GstPad *pad, GstPadProbeInfo *info, GstClockTime least)
{
  const auto meta = get_frame_meta (GST_PAD_PROBE_INFO_BUFFER (info));
  if (!meta || !GST_CLOCK_TIME_IS_VALID (meta->exposure_duration) ||
      meta->exposure_duration > least)
    return GST_PAD_PROBE_REMOVE;
  const auto camera = element_behind (pad);
  const auto in_us = [] (GstClockTime time) {
    return real_text (1e-3 * double (time)) + " us";
  };
  POST_ERROR (camera.get (), STREAM, WRONG_TYPE,
      "the camera exposes for " + in_us (meta->exposure_duration) +
          ", but the last slot of the schedule begins after " + in_us (least) +
          "; set a longer --exposure");
  return GST_PAD_PROBE_DROP;
}

/* Some of the period is left for the trigger of the next frame. */
Between
exposures_of (const SourcePlan &plan)
{
  constexpr double kPart = 0.99;
  const auto slots = SlotPlan::fit (
      plan.schedule.timing (), plan.schedule.slots (), plan.frame_rate);
  if (!slots)
    return {};
  return {1e-3 * double (slots->exposure ()),
      1e-3 * kPart * double (slots->frame_period ())};
}

void
watch_exposure (GstElement *behind_camera, const SourcePlan &plan)
{
  const auto slots = SlotPlan::fit (
      plan.schedule.timing (), plan.schedule.slots (), plan.frame_rate);
  if (slots)
    add_probe (pad_of (behind_camera, "sink").get (), GST_PAD_PROBE_TYPE_BUFFER,
        [least = GstClockTime (slots->start (slots->slots () - 1))] (
            GstPad *pad, GstPadProbeInfo *info) {
          return check_first_frame (pad, info, least);
        });
}

/* A camera that waits for its trigger gives up after two seconds, and the masks
 * may take longer to be sent: @p waiting, the element behind it, gets nothing
 * before a stream begins behind @p first, which has the masks sent before. */
void
begin_after (GstElement *waiting, GstElement *first)
{
  const gulong held = add_probe (pad_of (waiting, "sink").get (),
      GST_PAD_PROBE_TYPE_BLOCK | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
      [] (GstPad *, GstPadProbeInfo *) { return GST_PAD_PROBE_OK; });
  add_probe (pad_of (first, "src").get (), GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
      [waiting, held] (GstPad *, GstPadProbeInfo *info) {
        if (GST_EVENT_TYPE (GST_PAD_PROBE_INFO_EVENT (info)) !=
            GST_EVENT_STREAM_START)
          return GST_PAD_PROBE_OK;
        gst_pad_remove_probe (pad_of (waiting, "sink").get (), held);
        return GST_PAD_PROBE_REMOVE;
      });
}

/* The frames of a user's source may already have a schedule and times. */
void
synchronise (
    const SourceOptions &options, Chain &chain, const Settings &more = {})
{
  if (options.source && !options.device && !options.schedule)
    return;
  const auto clock =
      options.camera ? std::optional ("device-clock") : std::nullopt;
  Settings settings{{"schedule", options.schedule_text ()},
      {"device", options.device}, {"timestamp-at", clock},
      {"bench", options.bench}};
  settings.insert (settings.end (), more.begin (), more.end ());
  chain.to ("dmdsync", settings);
}

/* The camera of the simulated bench, behind the scene. */
void
simulate_camera (Job &job, const SourceOptions &options, const SourcePlan &plan,
    Chain &chain, const Settings &more)
{
  Settings settings{{"schedule", options.schedule_text ()},
      {"bench", options.bench}, {"psf-sigma", options.psf_sigma},
      {"full-well", options.full_well}, {"read-noise", options.read_noise},
      {"bits", options.bits}, {"gain", options.gain}, {"seed", options.seed},
      {"shift-x", options.shift_x}, {"shift-y", options.shift_y},
      {"rotation", options.rotation}, {"scale", options.scale}};
  settings.insert (settings.end (), more.begin (), more.end ());
  chain.to ("codedexposure-sim", settings);
  job.source = "the simulated bench";
  job.bench = chain.last ();
  chain.caps ("video/x-raw,framerate=" + rate_text (plan.frame_rate));
}

/* Of both beams, behind one scene and, if a device is set, one simulated DMD;
 * without it, the masks of both step with the frames. */
std::pair<Chain, Chain>
simulated_cameras (Job &job, const SourceOptions &options,
    const SourcePlan &plan, Pace pace, const SourceOptions &second)
{
  GstElement *light = scene (job, options, plan, pace).to ("tee").last ();
  Chain on = job.graph.from (light).to ("queue");
  Chain off = job.graph.from (light).to ("queue");
  simulate_camera (
      job, second, plan, off, {{"beam", "off"}, {"dmd", options.device}});
  simulate_camera (job, options, plan, on, {{"dmd", options.device}});
  return {std::move (on), std::move (off)};
}

} // namespace

/* Buffers for six seconds at 25 frames/s, while a disk is busy. */
Chain
camera_source (Job &job, const SourceOptions &options, const SourcePlan &plan)
{
  constexpr int kBuffers = 150;
  const bool is_measured = plan.bench && !plan.pixel_format.empty ();
  Chain chain = job.graph.begin ("codedexposure-camerasrc",
      {{"camera-name", options.camera},
          {"trigger", options.trigger.value_or ("dmd")},
          {"exposure-time", options.exposure},
          {"trigger-line", options.trigger_line},
          {"trigger-edge", options.trigger_edge},
          {"pixel-format",
              is_measured ? plan.pixel_format : options.pixel_format},
          {"features", options.features}, {"reconnect", options.reconnect},
          {"bench", options.bench}});
  gst_child_proxy_set (GST_CHILD_PROXY (chain.last ()),
      "source::num-arv-buffers", kBuffers, nullptr);
  job.camera = chain.last ();
  job.exposures = exposures_of (plan);
  return chain.caps (grey_caps (plan, plan.frame_rate));
}

Chain
simulation (Job &job, const SourceOptions &options, const SourcePlan &plan,
    Pace pace, const Settings &more)
{
  Chain chain = scene (job, options, plan, pace);
  simulate_camera (job, options, plan, chain, more);
  return chain;
}

Chain
user_source (Job &job, const std::string &description)
{
  GstElement *bin = job.graph.add_text (description);
  const ObjectPtr<GstPad> pad (gst_element_get_static_pad (bin, "src"));
  const CapsPtr gives (
      pad ? gst_pad_query_caps (pad.get (), nullptr) : nullptr);
  const CapsPtr coded (
      gst_caps_from_string ("video/x-raw,format={GRAY8,GRAY16_LE}"));
  if (gives && !gst_caps_can_intersect (gives.get (), coded.get ()))
    fail ("the frames of --source are " +
              std::string (CharPtr (gst_caps_to_string (gives.get ())).get ()) +
              "; coded frames are GRAY8 or GRAY16_LE: end it with \"! "
              "videoconvert ! capsfilter caps=video/x-raw,format=GRAY8\", if "
              "no pixel is scaled or moved before",
        Exit::usage);
  return job.graph.from (bin);
}

Chain
coded_source (
    Job &job, const SourceOptions &options, const SourcePlan &plan, Pace pace)
{
  Chain chain = options.camera   ? camera_source (job, options, plan)
                : options.source ? user_source (job, *options.source)
                                 : simulation (job, options, plan, pace,
                                       {{"dmd", "sim:bench"}});
  if (options.camera) {
    watch_exposure (chain.last (), plan);
    job.source = "the camera " + *options.camera;
  } else if (options.source)
    job.source = "--source";
  SourceOptions synchronised = options;
  if (options.is_simulated ())
    synchronised.device = options.device.value_or ("sim:bench");
  synchronise (synchronised, chain);
  limit_frames (job, options, chain);
  return chain;
}

/* The second camera has the first one's settings, and noise of its own. */
std::pair<Chain, Chain>
coded_sources (Job &job, const SourceOptions &options, const SourcePlan &plan,
    Pace pace, const SecondCamera &second)
{
  SourceOptions other = second.options (options);
  std::pair<Chain, Chain> both = [&] {
    if (!options.camera) {
      other.seed = 1 + options.seed.value_or (0);
      if (second.simulate)
        second.simulate (other);
      return simulated_cameras (job, options, plan, pace, other);
    }
    const SourcePlan its = SourcePlan::make (other);
    Chain off = camera_source (job, other, its);
    watch_exposure (off.last (), its);
    Chain on = camera_source (job, options, plan);
    watch_exposure (on.last (), plan);
    job.source = "the cameras " + *options.camera + " and " + *second.camera;
    return std::pair (std::move (on), std::move (off));
  }();
  GstElement *second_camera = both.second.last ();
  synchronise (options, both.first);
  if (options.camera)
    begin_after (second_camera, both.first.last ());
  synchronise (other, both.second, {{"beam", "off"}});
  limit_frames (job, options, both.second);
  limit_frames (job, options, both.first);
  return both;
}

Chain
coded_pairs (Job &job, const SourceOptions &options, const SourcePlan &plan,
    Pace pace, const SecondCamera &second, Nanoseconds patience)
{
  constexpr int kWaiting = 8; // frames
  const int waiting =
      kWaiting + int (patience * plan.frame_rate.num /
                      (plan.frame_rate.den * Nanoseconds (GST_SECOND)));
  auto [on, off] = coded_sources (job, options, plan, pace, second);
  GstElement *pair = job.graph.add (
      "codedexposure-pair", {{"latency", std::uint64_t (patience)}});
  off.queue (waiting).to (pair, "off");
  return on.queue (waiting).to (pair, "on");
}

/* identity ends the stream when it refuses the next frame, which was already
 * produced and counted; so the stream is ended directly after the last one. */
void
limit_frames (Job &job, const SourceOptions &options, Chain &chain)
{
  if (!options.frames)
    return;
  chain.to ("identity", {{"eos-after", *options.frames + 1}});
  job.total = *options.frames;
  add_probe (pad_of (chain.last (), "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
      [left = *options.frames] (GstPad *pad, GstPadProbeInfo *info) mutable {
        if (--left != 0)
          return GST_PAD_PROBE_OK;
        /* The push calls this probe again. */
        GstBuffer *last = GST_PAD_PROBE_INFO_BUFFER (info);
        GST_PAD_PROBE_INFO_DATA (info) = nullptr;
        const GstFlowReturn flow = gst_pad_push (pad, last);
        GST_PAD_PROBE_INFO_FLOW_RETURN (info) =
            flow == GST_FLOW_OK ? GST_FLOW_EOS : flow;
        return GST_PAD_PROBE_HANDLED;
      });
}

} // namespace codedexposure::app

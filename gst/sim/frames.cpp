/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Input frames come in, a coded frame goes out with the last of an exposure.
 *
 * An exposure begins with any input frame and takes those that follow it
 * without a gap. It is dropped as soon as one is missing, since light that was
 * lost cannot be made up for, and the next begins with the frame that came.
 */
#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "common/messages.h"
#include "common/meta.h"
#include "common/tag.h"
#include "sim.h"

#define GST_CAT_DEFAULT codedexposure_sim_debug

namespace codedexposure::gst::sim
{

namespace
{

bool
use_schedule (GstCodedExposureSim *self, ScheduleRef schedule)
{
  Stream &stream = state (self).stream;
  Result<Schedule> lit =
      stream.profile ? stream.profile->with_leak (*schedule) : *schedule;
  if (!lit)
    return refuse_settings (
        self, "The schedule cannot have the leak of the bench profile: " +
                  lit.error ().message);
  if (stream.beam == Beam::kOff)
    lit = lit->complement ();
  if (!lit)
    return refuse_settings (self, "beam=off: " + lit.error ().message + ".");
  stream.lit = *std::move (lit);
  stream.schedule = schedule;
  stream.tag_due = true;
  const ObjectLock lock (self);
  state (self).schedule = std::move (schedule);
  return true;
}

/* The schedule that the DMD was programmed with, else that of the property,
 * else the default. Null, with an error on the bus, when that one cannot be
 * read. */
ScheduleRef
wanted_schedule (GstCodedExposureSim *self)
{
  const Stream &stream = state (self).stream;
  if (stream.mirrors)
    if (std::optional<Schedule> programmed = stream.mirrors->schedule ())
      return std::make_shared<const Schedule> (*std::move (programmed));

  const Named<Schedule> named =
      locked (self, [&] { return state (self).settings.schedule; });
  if (!named.read)
    return std::make_shared<const Schedule> ();
  if (!check_named (self, "schedule", named))
    return nullptr;
  return ScheduleRef (named.read, &named.read->value ());
}

GstClockTime
input_time (const Plan &plan, guint64 inputs)
{
  return gst_util_uint64_scale (
      inputs, guint64 (plan.in.fps_d) * GST_SECOND, plan.in.fps_n);
}

/* Whether a frame at @pts is the one that follows @inputs input frames from
 * @start on; time stamps may be off by less than half a frame. */
bool
follows (const Plan &plan, GstClockTime start, int inputs, GstClockTime pts)
{
  const GstClockTimeDiff off =
      GST_CLOCK_DIFF (start + input_time (plan, inputs), pts);
  return GstClockTime (ABS (off)) < input_time (plan, 1) / 2;
}

bool
continues (const Plan &plan, const Exposure &exposure, GstBuffer *inbuf)
{
  return !GST_BUFFER_IS_DISCONT (inbuf) &&
         follows (plan, exposure.start, exposure.taken, GST_BUFFER_PTS (inbuf));
}

/* Exposures are counted in frame periods, so that the DMD's slots go on through
 * gaps. */
std::int64_t
next_frame (const Stream &stream, GstClockTime start)
{
  if (!GST_CLOCK_TIME_IS_VALID (stream.last_start) ||
      start <= stream.last_start)
    return stream.last_frame + 1;
  const guint64 periods = gst_util_uint64_scale_round (
      start - stream.last_start, stream.plan->out.fps_n,
      guint64 (stream.plan->out.fps_d) * GST_SECOND);
  return stream.last_frame + std::max<std::int64_t> (1, periods);
}

/* A dmdsync parks its mirrors for the time that it takes to change masks, so
 * that only those are warned of that never moved, or not for a second. */
void
watch_mirrors (GstCodedExposureSim *self, const std::vector<int> &masks)
{
  Stream &stream = state (self).stream;
  const bool moves = std::any_of (
      masks.begin (), masks.end (), [] (int mask) { return mask >= 0; });
  const GstVideoInfo &info = stream.plan->out;
  stream.parked_frames = moves ? 0 : stream.parked_frames + 1;
  stream.mirrors_moved |= moves;
  if (moves ||
      (stream.mirrors_moved && stream.parked_frames * info.fps_d < info.fps_n))
    return;
  if (std::exchange (stream.warned_parked, true))
    return;
  GST_ELEMENT_WARNING (self, RESOURCE, NOT_FOUND,
      ("The mirrors of the simulated DMD are parked: coded frames are dark "
       "until a dmdsync with the same device starts them."),
      ("this is posted once"));
}

/* The masks of all slots, at the start of the exposure, when the DMD begins to
 * step. */
std::vector<int>
find_masks (GstCodedExposureSim *self, std::int64_t frame)
{
  Stream &stream = state (self).stream;
  const int slots = stream.schedule->slots ();
  /* Mirrors that are parked throw all light at the second camera. */
  const int parked = stream.beam == Beam::kOff ? OpticalBench::kAllMirrors : -1;
  std::vector<int> masks;
  for (int slot = 0; slot < slots; slot++) {
    const std::int64_t counted = frame * slots + slot;
    const int mask = stream.mirrors
                         ? stream.view->mask_in_slot (counted).value_or (parked)
                         : int (counted % stream.schedule->masks ());
    masks.push_back (mask < 0 ? parked : mask);
  }
  if (stream.beam == Beam::kOn)
    watch_mirrors (self, masks);
  return masks;
}

/* The scene lies on the mirrors, one pixel on each. The mirrors of a diamond
 * array are addressed otherwise. */
bool
check_mirrors (GstCodedExposureSim *self, const SimulatedMirrors &mirrors)
{
  const GstVideoInfo &info = state (self).stream.plan->in;
  const auto [size, diamond] = mirrors.shape ();
  if (!size || diamond ||
      (size->width >= info.width && size->height >= info.height))
    return true;
  const std::string scene = size_text ({info.width, info.height});
  return refuse_settings (
      self, "The simulated DMD has " + size_text (*size) +
                " mirrors, but the scene has " + scene +
                " pixels, and each needs a mirror; set size=" + scene +
                " of its device, or leave the size out.");
}

/* Whether the profile, if there is one, is of a camera with such frames; @bits:
 * significant ones, as they were set. */
bool
check_profile (GstCodedExposureSim *self, int bits)
{
  const Stream &stream = state (self).stream;
  if (!stream.profile)
    return true;
  const GstVideoInfo &info = stream.plan->in;
  const int all = GST_VIDEO_FORMAT_INFO_BITS (info.finfo);
  if (bits == 0 && stream.profile->bits > all)
    bits = all;
  const auto good =
      stream.profile->check_frames ({info.width, info.height}, bits);
  if (!good)
    POST_ERROR (self, RESOURCE, SETTINGS,
        "The bench profile does not fit: " + good.error ().message + ".");
  return good.ok ();
}

/* Sets up the bench where it is missing or its settings changed. */
bool
prepare_bench (GstCodedExposureSim *self)
{
  Stream &stream = state (self).stream;
  const BenchOptions given =
      locked (self, [&] { return state (self).settings.optics; });
  BenchOptions optics =
      given.completed (stream.profile ? &*stream.profile : nullptr, stream.lit);
  if (stream.mirrors)
    optics.diamond = stream.mirrors->shape ().diamond;
  if (stream.bench && optics == stream.optics)
    return true;

  if (!check_profile (self, given.bits))
    return false;
  const GstVideoInfo &info = stream.plan->in;
  const int bits = GST_VIDEO_FORMAT_INFO_BITS (info.finfo);
  if (optics.bits > bits)
    return refuse_settings (
        self, "bits = " + std::to_string (optics.bits) + " is more than the " +
                  std::to_string (bits) + " bits of " +
                  std::string (GST_VIDEO_INFO_NAME (&info)) +
                  "; set fewer, or 0 for all.");
  Result<OpticalBench> made =
      OpticalBench::make (info.width, info.height, optics);
  if (!made)
    return refuse_settings (
        self, "The bench cannot be set up: " + made.error ().message + ".");
  stream.bench = *std::move (made);
  stream.optics = optics;
  return true;
}

GstFlowReturn
begin_exposure (GstCodedExposureSim *self, GstBuffer *inbuf)
{
  Stream &stream = state (self).stream;
  if (!prepare_bench (self) ||
      (stream.mirrors && !check_mirrors (self, *stream.mirrors)))
    return GST_FLOW_ERROR;

  Exposure exposure;
  exposure.start = GST_BUFFER_PTS (inbuf);
  exposure.frame = next_frame (stream, exposure.start);
  exposure.lost_before = exposure.frame - stream.last_frame - 1;
  /* The output buffer takes flags and metas of the first input frame. */
  auto *trans = GST_BASE_TRANSFORM (self);
  GstBuffer *outbuf = nullptr;
  const GstFlowReturn flow =
      GST_BASE_TRANSFORM_GET_CLASS (self)->prepare_output_buffer (
          trans, inbuf, &outbuf);
  exposure.outbuf.reset (outbuf);
  if (flow != GST_FLOW_OK)
    return flow;

  if (stream.discont || !follows (*stream.plan, stream.last_start,
                            stream.plan->inputs, exposure.start))
    GST_BUFFER_FLAG_SET (outbuf, GST_BUFFER_FLAG_DISCONT);
  exposure.masks = find_masks (self, exposure.frame);
  stream.discont = false;
  stream.last_start = exposure.start;
  stream.last_frame = exposure.frame;
  auto held = stream.view ? stream.view->held () : nullptr;
  if (held != stream.held)
    stream.seen = held && stream.beam == Beam::kOff
                      ? std::make_shared<const StillMask> (held->complement ())
                      : held;
  stream.held = std::move (held);
  stream.bench->begin (stream.lit, stream.seen);
  stream.exposure = std::move (exposure);
  return GST_FLOW_OK;
}

GstFlowReturn
collect_light (GstCodedExposureSim *self, GstBuffer *inbuf)
{
  Stream &stream = state (self).stream;
  const Plan &plan = *stream.plan;
  Exposure &exposure = *stream.exposure;
  const auto &shares = plan.shares[std::size_t (exposure.taken)];
  if (GST_BUFFER_FLAG_IS_SET (inbuf, GST_BUFFER_FLAG_CORRUPTED))
    GST_BUFFER_FLAG_SET (exposure.outbuf.get (), GST_BUFFER_FLAG_CORRUPTED);

  MappedFrame scene (plan.in, inbuf, GST_MAP_READ);
  if (!scene)
    return refuse_buffer (self, plan.in, inbuf);
  for (const LightShare &share : shares) {
    const int mask = exposure.masks[std::size_t (share.slot)];
    read_pixels (scene, [&] (auto pixels) {
      stream.bench->expose (pixels, mask, share.slots);
    });
  }
  if (const double between = plan.between[std::size_t (exposure.taken)];
      stream.beam == Beam::kOff && between > 0.0)
    read_pixels (scene, [&] (auto pixels) {
      stream.bench->expose (pixels, OpticalBench::kAllMirrors, between);
    });
  exposure.taken++;
  return GST_FLOW_OK;
}

GstFlowReturn
read_out (GstCodedExposureSim *self, const Exposure &exposure)
{
  Stream &stream = state (self).stream;
  GstBuffer *outbuf = exposure.outbuf.get ();
  MappedFrame coded (stream.plan->out, outbuf, GST_MAP_WRITE);
  if (!coded)
    return refuse_buffer (self, stream.plan->out, outbuf);
  write_pixels (coded,
      [&] (auto pixels) { stream.bench->read_out (exposure.frame, pixels); });
  return GST_FLOW_OK;
}

/* The meta of frames with fewer significant bits than their format. */
void
describe (const Stream &stream, const Exposure &exposure)
{
  const int bits = significant_bits_of (stream.optics.bits, stream.plan->out);
  if (bits == 0)
    return;
  FrameMeta meta;
  meta.frame = guint64 (exposure.frame);
  meta.lost_before = guint64 (exposure.lost_before);
  if (!stream.mirrors)
    meta.locked = true;
  meta.bits = bits;
  set_frame_meta (exposure.outbuf.get (), meta);
}

/* When the camera says that the exposure began. Without a DMD, the masks step
 * with the frames. */
GstClockTime
stamped_time (const Stream &stream, GstClockTime start)
{
  if (!stream.mirrors || !stream.profile || !stream.profile->trigger_delay)
    return start;
  const auto delay = std::llround (stream.profile->trigger_delay->value);
  return GstClockTime (
      std::max<GstClockTimeDiff> (0, GstClockTimeDiff (start) + delay));
}

GstBuffer *
stamp (GstCodedExposureSim *self, Exposure exposure)
{
  const guint64 number =
      locked (self, [&] { return state (self).counters.frames_out++; });
  const Stream &stream = state (self).stream;
  const GstVideoInfo &info = stream.plan->out;
  describe (stream, exposure);
  GstBuffer *outbuf = exposure.outbuf.release ();
  GST_BUFFER_PTS (outbuf) = stamped_time (stream, exposure.start);
  GST_BUFFER_DTS (outbuf) = GST_CLOCK_TIME_NONE;
  GST_BUFFER_DURATION (outbuf) =
      gst_util_uint64_scale (GST_SECOND, info.fps_d, info.fps_n);
  GST_BUFFER_OFFSET (outbuf) = number;
  GST_BUFFER_OFFSET_END (outbuf) = number + 1;
  GST_LOG_OBJECT (self, "[OUT] %" GST_TIME_FORMAT " frame %" G_GINT64_FORMAT,
      GST_TIME_ARGS (exposure.start), exposure.frame);
  return outbuf;
}

/* The mirrors of "sim:NAME"; what follows a comma is for the driver. Null for
 * anything else. */
std::shared_ptr<SimulatedMirrors>
find_mirrors (std::string_view device)
{
  constexpr std::string_view scheme = "sim:";
  if (!device.starts_with (scheme))
    return nullptr;
  device.remove_prefix (scheme.size ());
  const std::string name (device.substr (0, device.find (',')));
  return name.empty () ? nullptr : SimulatedMirrors::find (name);
}

const char *
name_of (Drop reason)
{
  constexpr const char *kNames[] = {"gap", "segment", "flush", "caps", "eos"};
  return kNames[int (reason)];
}

/* Drops that the user caused are only in the message for programs. */
void
tell_user (GstCodedExposureSim *self, Drop reason, GstClockTime start,
    const std::string &taken)
{
  Stream &stream = state (self).stream;
  if (reason == Drop::kEos)
    /* As debug text, since that is what gst-launch shows of an INFO. */
    GST_ELEMENT_INFO (self, STREAM, FAILED, (nullptr),
        ("The stream ended after %s of the coded frame at %" GST_TIME_FORMAT
         ", which is dropped.",
            taken.c_str (), GST_TIME_ARGS (start)));
  if (reason == Drop::kGap && !std::exchange (stream.warned_dropped, true))
    GST_ELEMENT_WARNING (self, STREAM, FAILED,
        ("A gap in the input after %s of the coded frame at %" GST_TIME_FORMAT
         ", which is dropped.",
            taken.c_str (), GST_TIME_ARGS (start)),
        ("this is posted once; the property frames-dropped counts them all"));
}

} // namespace

bool
follow_schedule (GstCodedExposureSim *self)
{
  Stream &stream = state (self).stream;
  ScheduleRef wanted = wanted_schedule (self);
  if (!wanted)
    return false;
  if (wanted == stream.schedule || *wanted == *stream.schedule)
    return true;
  GST_INFO_OBJECT (self, "schedule is now %s", wanted->text ().c_str ());
  if (!use_schedule (self, std::move (wanted)))
    return false;
  /* Another number of slots means another frame rate. */
  stream.plan.reset ();
  gst_base_transform_reconfigure_src (GST_BASE_TRANSFORM (self));
  return true;
}

bool
begin_stream (GstCodedExposureSim *self)
{
  Stream &stream = state (self).stream;
  const auto [dmd, bench, beam] = locked (self, [&] {
    const Settings &settings = state (self).settings;
    state (self).counters = Counters ();
    return std::tuple (settings.dmd, settings.bench, settings.beam);
  });
  stream.beam = beam;
  if (!check_named (self, "bench", bench))
    return false;
  if (bench.read)
    stream.profile = bench.read->value ().of_beam (beam == Beam::kOff);
  if (!dmd.empty () && !(stream.mirrors = find_mirrors (dmd)))
    return refuse_settings (
        self, "dmd '" + dmd +
                  "' is no simulated DMD; write sim:NAME, with the name that "
                  "dmdsync's device has.");
  if (stream.mirrors)
    stream.view = std::make_unique<SimulatedMirrors::View> (
        stream.mirrors, beam == Beam::kOn);
  ScheduleRef schedule = wanted_schedule (self);
  return schedule && use_schedule (self, std::move (schedule));
}

GstFlowReturn
submit_input_buffer (
    GstBaseTransform *trans, gboolean is_discont, GstBuffer *inbuf)
{
  auto *self = as<GstCodedExposureSim> (trans);
  Stream &stream = state (self).stream;
  BufferPtr owned (inbuf);
  GST_LOG_OBJECT (
      self, "[IN] %" GST_TIME_FORMAT, GST_TIME_ARGS (GST_BUFFER_PTS (inbuf)));
  if (!GST_BUFFER_PTS_IS_VALID (inbuf)) {
    POST_ERROR (self, STREAM, FORMAT,
        "An input frame has no time stamp, and nothing says which slot it "
        "belongs to; let the source set one (do-timestamp=true), or put "
        "videorate before codedexposure-sim.");
    return GST_FLOW_ERROR;
  }
  if (trans->segment.rate < 0.0) {
    POST_ERROR (self, STREAM, NOT_IMPLEMENTED,
        "Light cannot be collected backwards; play at a positive rate.");
    return GST_FLOW_ERROR;
  }

  if (stream.exposure && !continues (*stream.plan, *stream.exposure, inbuf))
    drop_exposure (self, Drop::kGap);
  if (!stream.exposure && !follow_schedule (self))
    return GST_FLOW_ERROR;

  const GstFlowReturn flow =
      GST_BASE_TRANSFORM_CLASS (g_type_class_peek (GST_TYPE_VIDEO_FILTER))
          ->submit_input_buffer (trans, is_discont, owned.release ());
  /* No plan is made for caps that did not change. */
  const GstVideoFilter *filter = GST_VIDEO_FILTER (trans);
  if (flow == GST_FLOW_OK && !stream.plan &&
      !make_plan (self, filter->in_info, filter->out_info))
    return GST_FLOW_NOT_NEGOTIATED;
  return flow;
}

GstFlowReturn
generate_output (GstBaseTransform *trans, GstBuffer **outbuf)
{
  auto *self = as<GstCodedExposureSim> (trans);
  Stream &stream = state (self).stream;
  const BufferPtr inbuf (std::exchange (trans->queued_buf, nullptr));
  *outbuf = nullptr;
  if (!inbuf)
    return GST_FLOW_OK;

  GstFlowReturn flow = GST_FLOW_OK;
  if (!stream.exposure)
    flow = begin_exposure (self, inbuf.get ());
  if (flow == GST_FLOW_OK)
    flow = collect_light (self, inbuf.get ());
  if (flow != GST_FLOW_OK)
    drop_exposure (self, Drop::kGap);
  if (flow != GST_FLOW_OK || stream.exposure->taken < stream.plan->inputs)
    return flow;

  Exposure exposure = std::move (*stream.exposure);
  stream.exposure.reset ();
  flow = read_out (self, exposure);
  if (flow != GST_FLOW_OK)
    return flow;
  push_tag (self);
  *outbuf = stamp (self, std::move (exposure));
  return GST_FLOW_OK;
}

void
drop_exposure (GstCodedExposureSim *self, Drop reason)
{
  Stream &stream = state (self).stream;
  if (!stream.exposure)
    return;
  const Exposure exposure = std::move (*stream.exposure);
  const int needed = stream.plan->inputs;
  stream.exposure.reset ();
  stream.discont = true;
  const guint64 dropped =
      locked (self, [&] { return ++state (self).counters.frames_dropped; });
  const std::string taken = std::to_string (exposure.taken) + " of " +
                            std::to_string (needed) + " input frames";
  GST_INFO_OBJECT (self,
      "drop the coded frame at %" GST_TIME_FORMAT " after %s: %s",
      GST_TIME_ARGS (exposure.start), taken.c_str (), name_of (reason));
  post_message (self, ExposureDropped{name_of (reason), exposure.start,
                          exposure.taken, needed, dropped});
  tell_user (self, reason, exposure.start, taken);
  g_object_notify (G_OBJECT (self), "frames-dropped");
}

void
restart (GstCodedExposureSim *self, Drop reason)
{
  drop_exposure (self, reason);
  Stream &stream = state (self).stream;
  stream.discont = true;
  stream.last_start = GST_CLOCK_TIME_NONE;
}

StreamSetup
own_setup (GstCodedExposureSim *self)
{
  StreamSetup setup = setup_at (
      GST_BASE_TRANSFORM_SRC_PAD (self), *state (self).stream.schedule);
  setup.simulated = true;
  setup.off_beam = state (self).stream.beam == Beam::kOff;
  setup.bits = significant_bits_of (
      state (self).stream.optics.bits, state (self).stream.plan->out);
  setup.bench = state (self).stream.profile;
  return setup;
}

void
push_tag (GstCodedExposureSim *self)
{
  if (std::exchange (state (self).stream.tag_due, false))
    gst_pad_push_event (
        GST_BASE_TRANSFORM_SRC_PAD (self), setup_to_event (own_setup (self)));
}

} // namespace codedexposure::gst::sim

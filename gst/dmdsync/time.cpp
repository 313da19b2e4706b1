/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync's clocks: the camera's, the pipeline's, and what lies between. */
#include <cmath>

#include "common/messages.h"
#include "dmdsync.h"

#define GST_CAT_DEFAULT dmdsync_debug

namespace codedexposure::gst::sync
{

namespace
{

/* Latency grows in steps of this, since a pipeline is reconfigured for each. */
constexpr GstClockTime kJitterStep = GST_MSECOND;

/* Times that may be wrong by more than this are not known; they are known again
 * below it. The margin is against saying so over and over. */
constexpr GstClockTime kKnown = 50 * GST_USECOND;
constexpr GstClockTime kNotKnown = 2 * kKnown;

GstStaticCaps device_caps = GST_STATIC_CAPS ("timestamp/x-camera-device");
GstStaticCaps arrival_caps = GST_STATIC_CAPS ("timestamp/x-arrival");

void
keep (GstBuffer *frame, GstStaticCaps &clock, GstClockTime time)
{
  const CapsPtr caps (gst_static_caps_get (&clock));
  gst_buffer_add_reference_timestamp_meta (
      frame, caps.get (), time, GST_CLOCK_TIME_NONE);
}

/** Now, as a PTS; none while there is no clock. */
GstClockTime
arrival_time (GstDmdSync *self)
{
  const ObjectPtr<GstClock> clock (gst_element_get_clock (GST_ELEMENT (self)));
  if (!clock || GST_BASE_TRANSFORM (self)->segment.format != GST_FORMAT_TIME)
    return GST_CLOCK_TIME_NONE;
  const GstClockTime now = gst_clock_get_time (clock.get ());
  const GstClockTime base = gst_element_get_base_time (GST_ELEMENT (self));
  return now < base ? GST_CLOCK_TIME_NONE
                    : gst_segment_position_from_running_time (
                          &GST_BASE_TRANSFORM (self)->segment, GST_FORMAT_TIME,
                          now - base);
}

/** What frames come late by is latency, unless they were held up by more than a
 * frame period: that is no jitter. */
void
note_jitter (GstDmdSync *self, GstClockTime lateness)
{
  SyncState &st = state (self);
  const GstClockTime steps =
      (lateness + kJitterStep - 1) / kJitterStep * kJitterStep;
  {
    const ObjectLock lock (self);
    if (steps <= st.jitter || steps > GstClockTime (st.time->rate.period ()))
      return;
    st.jitter = steps;
  }
  update_latency (self);
}

GstClockTimeDiff
exposure_offset (const SyncState &st)
{
  if (st.settings.exposure_offset != 0 || !st.bench || !st.bench->trigger_delay)
    return st.settings.exposure_offset;
  return std::llround (st.bench->trigger_delay->value);
}

} // namespace

GstClockTimeDiff
moved_back (const SyncState &st)
{
  if (!st.time)
    return 0;
  const SlotPlan &plan = st.time->plan;
  switch (st.settings.timestamp_at) {
  case TimestampAt::exposure_end:
    return plan.exposure () + exposure_offset (st);
  case TimestampAt::arrival:
  case TimestampAt::device_clock:
    return plan.frame_period () + exposure_offset (st);
  default:
    return exposure_offset (st);
  }
}

void
update_latency (GstDmdSync *self)
{
  SyncState &st = state (self);
  set_latency (self, st.latency, [&st] {
    return GstClockTime (std::max<GstClockTimeDiff> (
        0, moved_back (st) + GstClockTimeDiff (st.jitter)));
  });
}

GstClockTime
pipeline_time (GstDmdSync *self, GstBuffer *frame)
{
  SyncState &st = state (self);
  const GstClockTime device = GST_BUFFER_PTS (frame);
  st.stream.uncertainty = GST_CLOCK_TIME_NONE;
  {
    const ObjectLock lock (self);
    if (st.settings.timestamp_at != TimestampAt::device_clock)
      return device;
  }
  keep (frame, device_caps, device);
  const GstClockTime arrival = arrival_time (self);
  if (!GST_CLOCK_TIME_IS_VALID (arrival))
    return device;
  keep (frame, arrival_caps, arrival);
  st.stream.last_arrival = arrival;

  DeviceClock &clock = st.stream.device_clock;
  const Nanoseconds time =
      clock.take (Nanoseconds (device), Nanoseconds (arrival));
  GST_LOG_OBJECT (self,
      "camera %" GST_TIME_FORMAT " arrived %" GST_TIME_FORMAT
      ", %" G_GINT64_FORMAT " ns late; its clock drifts by %.1f ppm",
      GST_TIME_ARGS (device), GST_TIME_ARGS (arrival), clock.lateness (),
      clock.drift () * 1e6);
  if (const auto uncertainty = clock.uncertainty ())
    st.stream.uncertainty = GstClockTime (*uncertainty);
  locked (self, [&] {
    st.counters.clock_restarts = clock.restarts ();
    st.counters.clock_drift = clock.drift () * 1e6;
    st.counters.time_uncertainty = st.stream.uncertainty;
  });
  note_jitter (self, GstClockTime (clock.lateness ()));
  return GstClockTime (std::max<Nanoseconds> (0, time));
}

GstClockTime
pipeline_time_of_gap (GstDmdSync *self, GstClockTime time)
{
  const SyncState &st = state (self);
  {
    const ObjectLock lock (self);
    if (st.settings.timestamp_at != TimestampAt::device_clock)
      return time;
  }
  if (const auto known = st.stream.device_clock.time_of (Nanoseconds (time)))
    return GstClockTime (std::max<Nanoseconds> (0, *known));
  const GstClockTime now = arrival_time (self);
  return GST_CLOCK_TIME_IS_VALID (now) ? now : time;
}

void
say_uncertainty (GstDmdSync *self, guint64 number, GstClockTime pts)
{
  Stream &stream = state (self).stream;
  if (!GST_CLOCK_TIME_IS_VALID (stream.last_arrival))
    return;
  const bool knew = stream.time_known.value_or (false);
  const bool known = stream.uncertainty <= (knew ? kNotKnown : kKnown);
  if (stream.time_known == known)
    return;
  stream.time_known = known;
  post_message (self, TimeUncertainty{known, stream.uncertainty, number, pts});
}

void
note_end (GstDmdSync *self)
{
  constexpr GstClockTime kSilence = GST_SECOND;
  const GstClockTime last = state (self).stream.last_arrival;
  const GstClockTime now = arrival_time (self);
  if (!GST_CLOCK_TIME_IS_VALID (last) || !GST_CLOCK_TIME_IS_VALID (now) ||
      now < last + kSilence)
    return;
  GST_ELEMENT_WARNING (self, RESOURCE, READ,
      ("The stream ends %.1f s after its last frame: the camera stopped, was "
       "unplugged or gets no trigger, or this process was stopped for so long. "
       "Look at its cable, at the DMD and at the line between them.",
          double (now - last) / GST_SECOND),
      (nullptr));
}

void
watch_rate (GstDmdSync *self, GstClockTime time)
{
  Stream &stream = state (self).stream;
  if (describe_switch (self).switching)
    stream.rate_watch->resync ();
  const auto rate = stream.rate_watch->take (Nanoseconds (time));
  if (!rate)
    return;
  const FrameRate said = stream.time->rate;
  post_message (self, MeasuredRate{*rate, said});
  GST_ELEMENT_WARNING (self, RESOURCE, SETTINGS,
      ("Frames come at %.4g a second, the caps say %d/%d. The device that "
       "triggers the camera sets its rate: set the caps to the rate of the "
       "trigger.",
          *rate, said.num, said.den),
      (nullptr));
}

} // namespace codedexposure::gst::sync

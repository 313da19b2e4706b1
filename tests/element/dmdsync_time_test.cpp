/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync after a camera that stamps frames with its own clock. */
#include <cmath>
#include <optional>
#include <random>

#include "sync_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

constexpr GstClockTime kMs = GST_MSECOND;

/** The reference timestamp of a frame for the clock in @p caps. */
GstClockTime
reference_time (const BufferPtr &frame, const char *caps)
{
  const GstReferenceTimestampMeta *meta =
      gst_buffer_get_reference_timestamp_meta (
          frame.get (), caps_of (caps).get ());
  return meta ? meta->timestamp : GST_CLOCK_TIME_NONE;
}

/* The camera's clock is 200 ppm fast; frames take a frame period and up to 5 ms
 * more to arrive. */
class DmdsyncDeviceClock : public ::testing::TestWithParam<FrameRate>
{
protected:
  DmdsyncDeviceClock ()
  {
    gst_harness_use_testclock (sync_.get ());
    sync_.start (rate_);
  }

  GstClockTime exposure (int frame) const
  {
    return 3 * GST_SECOND + sync_.time_of (frame);
  }
  GstClockTime stamp (int frame) const
  {
    return 3 * GST_SECOND + GstClockTime (std::llround (
                                1.0002 * double (sync_.time_of (frame))));
  }
  BufferPtr send (int frame, GstClockTime delay)
  {
    arrival_ = exposure (frame) + GstClockTime (rate_.period ()) + delay;
    gst_harness_set_time (sync_.get (), arrival_);
    EXPECT_EQ (sync_.send (stamp (frame)), GST_FLOW_OK);
    return sync_.pull ();
  }

  const FrameRate rate_ = GetParam ();
  SyncHarness sync_{"timestamp-at=device-clock"};
  GstClockTime arrival_ = 0;
};

/** The last message on the uncertainty; none if there was none since. */
std::optional<bool>
times_are_known (SyncHarness &sync)
{
  std::optional<bool> known;
  while (const auto said = sync.element_message ("dmdsync/time-uncertainty")) {
    gboolean value = FALSE;
    EXPECT_TRUE (gst_structure_get_boolean (
        gst_message_get_structure (said.get ()), "known", &value));
    known = value;
  }
  return known;
}

TEST_P (DmdsyncDeviceClock, PtsIsTheStartOfTheExposureWithin50Microseconds)
{
  std::mt19937 random (1);
  std::uniform_int_distribution<GstClockTime> delay (0, 5 * kMs);
  const int settled = int (90 * GST_SECOND / GstClockTime (rate_.period ()));
  int known_from = -1;
  int beyond = 0;
  for (int k = 0; k < settled + 500; k++) {
    const BufferPtr frame = send (k, delay (random));
    ASSERT_TRUE (frame);
    ASSERT_EQ (reference_time (frame, "timestamp/x-camera-device"), stamp (k));
    ASSERT_EQ (reference_time (frame, "timestamp/x-arrival"), arrival_);
    ASSERT_EQ (
        GST_BUFFER_DURATION (frame.get ()), GstClockTime (rate_.period ()));
    ASSERT_EQ (GST_BUFFER_OFFSET (frame.get ()), guint64 (k));
    const GstClockTime uncertainty =
        get_frame_meta (frame.get ())->time_uncertainty;
    ASSERT_EQ (GST_CLOCK_TIME_IS_VALID (uncertainty), k >= 7);
    if (const auto said = times_are_known (sync_)) {
      ASSERT_EQ (*said, known_from < 0 && k > 0) << k;
      ASSERT_TRUE (*said ? uncertainty <= 50 * GST_USECOND
                         : uncertainty > 100 * GST_USECOND)
          << "known below one bound and lost above the other: " << k;
      known_from = *said ? k : -1;
    }
    const auto error = GstClockTime (std::abs (
        GST_CLOCK_DIFF (exposure (k), GST_BUFFER_PTS (frame.get ()))));
    beyond += known_from >= 0 && error > uncertainty;
    ASSERT_TRUE (known_from < 0 || uncertainty <= 100 * GST_USECOND) << k;
    ASSERT_TRUE (k < settled || error <= 50 * GST_USECOND) << k;
  }
  ASSERT_GE (known_from, 0);
  EXPECT_LT (known_from, settled / 2);
  EXPECT_LT (beyond, settled / 5);
  EXPECT_EQ (sync_.counter ("frames-lost"), 0u);
  EXPECT_EQ (sync_.counter ("clock-restarts"), 0u);
  EXPECT_LE (sync_.counter ("time-uncertainty"), 25 * GST_USECOND);
  /* The times of the first frames were less certain. */
  const GstClockTime latency = gst_harness_query_latency (sync_.get ());
  EXPECT_GE (latency, GstClockTime (rate_.period ()) + 5 * kMs);
  EXPECT_LE (latency, GstClockTime (rate_.period ()) + 6 * kMs);
}

TEST_P (DmdsyncDeviceClock, LatencyIsAnnouncedWhenItGrows)
{
  ASSERT_TRUE (send (0, 0));
  while (sync_.message (GST_MESSAGE_LATENCY))
    ;
  const GstClockTime transfer = GstClockTime (rate_.period ());
  EXPECT_EQ (gst_harness_query_latency (sync_.get ()), transfer);
  ASSERT_TRUE (send (1, 0));
  EXPECT_FALSE (sync_.message (GST_MESSAGE_LATENCY));

  ASSERT_TRUE (send (2, 2'500'000));
  EXPECT_TRUE (sync_.message (GST_MESSAGE_LATENCY));
  EXPECT_EQ (gst_harness_query_latency (sync_.get ()), transfer + 3 * kMs);

  /* A delay of seconds does not count as jitter. */
  ASSERT_TRUE (send (3, 2 * GST_SECOND));
  EXPECT_FALSE (sync_.message (GST_MESSAGE_LATENCY));
  EXPECT_EQ (gst_harness_query_latency (sync_.get ()), transfer + 3 * kMs);
}

TEST_P (DmdsyncDeviceClock, ANewSegmentIsANewClock)
{
  for (int k = 0; k < 300; k++)
    ASSERT_TRUE (send (k, 0));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  sync_.push_event (gst_event_new_segment (&segment));

  /* The camera was disconnected; its first frame has the time of its arrival.
   */
  const GstClockTime back = exposure (900) + 7 * kMs;
  gst_harness_set_time (sync_.get (), back);
  ASSERT_EQ (sync_.send (back), GST_FLOW_OK);
  const BufferPtr frame = sync_.pull ();
  ASSERT_TRUE (frame);
  EXPECT_EQ (
      GST_BUFFER_PTS (frame.get ()), back - GstClockTime (rate_.period ()));
}

/* As codedexposure-camerasrc flags the first frame of a camera that was
 * restarted, whose time begins at 0 again. */
TEST_P (DmdsyncDeviceClock, AfterARestartFramesAreNumberedByWhenTheyArrive)
{
  for (int k = 0; k < 300; k++)
    ASSERT_TRUE (send (k, 0));
  for (int k = 900; k < 910; k++) {
    SCOPED_TRACE (k);
    BufferPtr frame = frame_of (draw<std::uint8_t> (kSyncWidth, kSyncHeight,
                                    [] (int, int) { return 100; }),
        stamp (k) - stamp (900));
    if (k == 900)
      GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_RESYNC);
    gst_harness_set_time (
        sync_.get (), exposure (k) + GstClockTime (rate_.period ()));
    ASSERT_EQ (sync_.push (std::move (frame)), GST_FLOW_OK);
    const BufferPtr out = sync_.pull ();
    ASSERT_TRUE (out);
    EXPECT_EQ (meta_of (out).frame, guint64 (k));
    EXPECT_EQ (meta_of (out).lost_before, k == 900 ? 600u : 0u);
    EXPECT_EQ (has_flag (out, GST_BUFFER_FLAG_DISCONT), k == 900);
    EXPECT_FALSE (has_flag (out, GST_BUFFER_FLAG_RESYNC));
    EXPECT_LE (
        std::abs (GST_CLOCK_DIFF (exposure (k), GST_BUFFER_PTS (out.get ()))),
        gint64 (50 * GST_USECOND));
  }
  EXPECT_EQ (sync_.counter ("frames-lost"), 600u);
  EXPECT_EQ (sync_.counter ("frames-late"), 0u);
}

TEST_P (DmdsyncDeviceClock, AGapMovesAsFramesDo)
{
  /* A device that counts from another moment than the pipeline. */
  constexpr GstClockTime kAhead = 1000 * GST_SECOND;
  const auto period = GstClockTime (rate_.period ());
  const auto gap_at = [&] (int k) {
    sync_.push_event (gst_event_new_gap (kAhead + stamp (k), period));
    GstClockTime pts = GST_CLOCK_TIME_NONE, duration = 0;
    if (const EventPtr gap = sync_.pull_event (GST_EVENT_GAP))
      gst_event_parse_gap (gap.get (), &pts, &duration);
    EXPECT_EQ (duration, period);
    return pts;
  };
  /* Before the first frame there is only the time at which it comes. */
  gst_harness_set_time (sync_.get (), exposure (0) + period);
  EXPECT_EQ (gap_at (0), exposure (0));
  for (int k = 1; k < 300; k++) {
    gst_harness_set_time (sync_.get (), exposure (k) + period);
    ASSERT_EQ (sync_.send (kAhead + stamp (k)), GST_FLOW_OK);
    ASSERT_TRUE (sync_.pull ());
  }
  for (const int k : {300, 290})
    EXPECT_LE (std::abs (GST_CLOCK_DIFF (exposure (k), gap_at (k))),
        gint64 (50 * GST_USECOND))
        << k;
  EXPECT_EQ (sync_.counter ("clock-restarts"), 0u);
}

INSTANTIATE_TEST_SUITE_P (Rates, DmdsyncDeviceClock,
    ::testing::Values (FrameRate{25, 1}, FrameRate{30000, 1001}),
    [] (const auto &info) { return "num" + std::to_string (info.param.num); });

} // namespace

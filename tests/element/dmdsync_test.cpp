/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync without a DMD: time, numbers, losses, flags and queries. */
#include "sync_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

constexpr GstClockTime kMs = GST_MSECOND;

class DmdsyncTime : public ::testing::TestWithParam<FrameRate>
{
};

TEST_P (DmdsyncTime, StampsAndNumbersEveryFrameExactly)
{
  const FrameRate rate = GetParam ();
  const SlotPlan plan = *SlotPlan::fit ({}, 4, rate);
  SyncHarness sync;
  sync.start (rate);
  for (int k = 0; k < 100; k++) {
    ASSERT_EQ (sync.send (sync.time_of (k)), GST_FLOW_OK);
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame);
    EXPECT_EQ (GST_BUFFER_PTS (frame.get ()), sync.time_of (k));
    EXPECT_EQ (GST_BUFFER_DTS (frame.get ()), GST_CLOCK_TIME_NONE);
    EXPECT_EQ (
        GST_BUFFER_DURATION (frame.get ()), GstClockTime (rate.period ()));
    EXPECT_EQ (GST_BUFFER_OFFSET (frame.get ()), guint64 (k));
    EXPECT_EQ (GST_BUFFER_OFFSET_END (frame.get ()), guint64 (k + 1));
    EXPECT_EQ (has_flag (frame, GST_BUFFER_FLAG_DISCONT), k == 0);
    EXPECT_FALSE (has_flag (frame, GST_BUFFER_FLAG_CORRUPTED));

    const FrameMeta meta = meta_of (frame);
    EXPECT_EQ (meta.frame, guint64 (k));
    EXPECT_EQ (meta.subframe, -1);
    EXPECT_EQ (meta.exposure_start, sync.time_of (k));
    EXPECT_EQ (meta.exposure_duration, GstClockTime (plan.exposure ()));
    EXPECT_FALSE (meta.locked) << "no DMD, and nothing to see";
    EXPECT_EQ (meta.slip, 0);
    EXPECT_EQ (meta.lost_before, 0u);
  }
  EXPECT_EQ (sync.counter ("frames-in"), 100u);
  EXPECT_EQ (sync.counter ("frames-lost"), 0u);
  EXPECT_EQ (sync.error () + sync.warning (), "");
}

TEST_P (DmdsyncTime, MovesPtsBackToTheStartOfTheExposure)
{
  const FrameRate rate = GetParam ();
  /* Slots of 8 ms, 32.4 ms from the first light to the last. */
  const char *schedule =
      "schedule=staircase:2x2,active=8ms,switching=0.1ms,readout=0.5ms ";
  const struct {
    const char *settings;
    GstClockTimeDiff back;
  } cases[] = {{"timestamp-at=exposure-start", 0},
      {"timestamp-at=exposure-end", 32'300'000},
      {"timestamp-at=arrival", rate.period ()},
      {"timestamp-at=arrival exposure-offset=105001", rate.period () + 105'001},
      {"exposure-offset=-2500000", -2'500'000}};
  for (const auto &[settings, back] : cases) {
    SCOPED_TRACE (settings);
    SyncHarness sync (schedule + std::string (settings));
    sync.start (rate);
    for (int k = 3; k < 20; k++) {
      ASSERT_EQ (sync.send (sync.time_of (k)), GST_FLOW_OK);
      const BufferPtr frame = sync.pull ();
      ASSERT_TRUE (frame);
      EXPECT_EQ (GstClockTimeDiff (GST_BUFFER_PTS (frame.get ())),
          GstClockTimeDiff (sync.time_of (k)) - back);
      const FrameMeta meta = meta_of (frame);
      EXPECT_EQ (meta.exposure_start, GST_BUFFER_PTS (frame.get ()));
      EXPECT_EQ (meta.exposure_duration, 32'300'000u);
    }
    EXPECT_EQ (gst_harness_query_latency (sync.get ()),
        GstClockTime (std::max<GstClockTimeDiff> (0, back)));
  }
}

INSTANTIATE_TEST_SUITE_P (Rates, DmdsyncTime,
    ::testing::Values (FrameRate{25, 1}, FrameRate{30000, 1001}),
    [] (const auto &info) { return "num" + std::to_string (info.param.num); });

TEST (Dmdsync, FramesBeforeTheStreamsTimeAreDroppedAndSaid)
{
  SyncHarness sync ("timestamp-at=arrival");
  sync.start ();
  sync.send_frames (0, 3);
  const BufferPtr first = sync.pull ();
  ASSERT_TRUE (first);
  EXPECT_EQ (GST_BUFFER_PTS (first.get ()), 0u);
  EXPECT_EQ (meta_of (first).frame, 1u);
  EXPECT_TRUE (has_flag (first, GST_BUFFER_FLAG_DISCONT));
  EXPECT_TRUE (sync.pull ());
  EXPECT_FALSE (sync.pull ());

  EXPECT_EQ (sync.counter ("frames-early"), 1u);
  const MessagePtr said = sync.element_message ("dmdsync/frame-dropped");
  EXPECT_EQ (string_field (said, "reason"), "before-start");
  EXPECT_EQ (uint64_field (said, "frame"), 0u);
}

TEST (Dmdsync, ALossIsCountedFlaggedAndSaid)
{
  SyncHarness sync;
  sync.start ();
  sync.send_frames (0, 2);
  while (sync.pull_event (GST_EVENT_GAP))
    ADD_FAILURE () << "nothing was lost yet";
  sync.send_frames (5, 7);

  for (const int k : {0, 1, 5, 6}) {
    SCOPED_TRACE (k);
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame);
    EXPECT_EQ (GST_BUFFER_PTS (frame.get ()), 40 * kMs * guint64 (k));
    EXPECT_EQ (GST_BUFFER_OFFSET (frame.get ()), guint64 (k));
    EXPECT_EQ (has_flag (frame, GST_BUFFER_FLAG_DISCONT), k == 0 || k == 5);
    EXPECT_EQ (meta_of (frame).lost_before, k == 5 ? 3u : 0u);
    EXPECT_FALSE (meta_of (frame).locked) << "unknown";
  }
  EXPECT_EQ (sync.counter ("frames-lost"), 3u);

  const EventPtr gap = sync.pull_event (GST_EVENT_GAP);
  ASSERT_TRUE (gap);
  GstClockTime from = 0;
  GstClockTime length = 0;
  gst_event_parse_gap (gap.get (), &from, &length);
  EXPECT_EQ (from, 80 * kMs);
  EXPECT_EQ (length, 120 * kMs);

  const MessagePtr said = sync.element_message ("codedexposure/frames-lost");
  EXPECT_EQ (uint64_field (said, "count"), 3u);
  EXPECT_EQ (uint64_field (said, "from"), 80 * kMs);
  EXPECT_EQ (uint64_field (said, "to"), 200 * kMs);
  EXPECT_FALSE (sync.element_message ("codedexposure/frames-lost"));
}

TEST (Dmdsync, AFrameThatIsOnlyLateShiftsNoNumbers)
{
  SyncHarness sync;
  sync.start ();
  const std::pair<GstClockTime, guint64> frames[] = {{0, 0}, {40 * kMs, 1},
      {80 * kMs, 2}, {144'500'000, 4}, {160 * kMs, 3}, {200 * kMs, 5},
      {240 * kMs, 6}};
  for (const auto &[time, number] : frames) {
    ASSERT_EQ (sync.send (time), GST_FLOW_OK);
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame) << number;
    EXPECT_EQ (meta_of (frame).frame, number);
    EXPECT_EQ (GST_BUFFER_PTS (frame.get ()), time);
    EXPECT_EQ (meta_of (frame).lost_before, number == 4 ? 1u : 0u);
  }
  EXPECT_EQ (sync.counter ("frames-lost"), 0u);
  EXPECT_EQ (sync.counter ("frames-late"), 1u);
  EXPECT_EQ (
      uint64_field (sync.element_message ("dmdsync/frame-late"), "frame"), 3u);
}

TEST (Dmdsync, LostFramesCanBeRepeatedFromMemoryOfOurOwn)
{
  SyncHarness sync ("on-loss=repeat timestamp-at=exposure-end");
  sync.start ({30000, 1001});
  BufferPtr reused = frame_of (draw<std::uint8_t> (kSyncWidth, kSyncHeight,
                                   [] (int, int) { return 77; }),
      sync.time_of (4));
  GstBuffer *of_camera = gst_buffer_ref (reused.get ());
  ASSERT_EQ (sync.push (std::move (reused)), GST_FLOW_OK);
  ASSERT_TRUE (sync.pull ());
  /* The camera source writes the next frame into the memory of this one. */
  gst_buffer_memset (of_camera, 0, 5, gst_buffer_get_size (of_camera));
  gst_buffer_unref (of_camera);

  ASSERT_EQ (sync.send (sync.time_of (7)), GST_FLOW_OK);
  const CapsPtr caps = sync.pad_caps ();
  const GstClockTime seventh =
      sync.time_of (7) -
      GstClockTime (SlotPlan::fit ({}, 4, {30000, 1001})->exposure ());
  for (const int k : {1, 2}) {
    SCOPED_TRACE (k);
    const BufferPtr filler = sync.pull ();
    ASSERT_TRUE (filler);
    EXPECT_EQ (GST_BUFFER_PTS (filler.get ()),
        seventh - sync.time_of (2) + sync.time_of (k - 1));
    EXPECT_EQ (GST_BUFFER_OFFSET (filler.get ()), guint64 (k));
    EXPECT_TRUE (has_flag (filler, GST_BUFFER_FLAG_GAP));
    EXPECT_TRUE (has_flag (filler, GST_BUFFER_FLAG_DROPPABLE));
    EXPECT_EQ (has_flag (filler, GST_BUFFER_FLAG_DISCONT), k == 1);
    EXPECT_EQ (
        image_of<std::uint8_t> (filler.get (), caps.get ()).at (3, 3), 77);
    EXPECT_FALSE (meta_of (filler).locked) << "unknown";
  }
  const BufferPtr frame = sync.pull ();
  ASSERT_TRUE (frame);
  EXPECT_EQ (GST_BUFFER_PTS (frame.get ()), seventh);
  EXPECT_EQ (GST_BUFFER_OFFSET (frame.get ()), 3u);
  EXPECT_FALSE (has_flag (frame, GST_BUFFER_FLAG_GAP));
  EXPECT_EQ (sync.counter ("frames-repeated"), 2u);
  EXPECT_EQ (sync.counter ("frames-lost"), 2u);
}

TEST (Dmdsync, AnHourThatIsLostIsNotFilledWithRepeats)
{
  SyncHarness sync ("on-loss=repeat");
  sync.start ();
  sync.send_frames (0, 1);
  ASSERT_EQ (sync.send (3600 * GST_SECOND), GST_FLOW_OK);
  EXPECT_TRUE (sync.pull ());
  EXPECT_TRUE (sync.pull ());
  EXPECT_FALSE (sync.pull ());
  EXPECT_EQ (sync.counter ("frames-lost"), 89'999u);
  EXPECT_EQ (sync.counter ("frames-repeated"), 0u);
}

TEST (Dmdsync, ALossCanEndTheStream)
{
  SyncHarness sync ("on-loss=error");
  sync.start ();
  sync.send_frames (0, 2);
  EXPECT_EQ (sync.send (160 * kMs), GST_FLOW_ERROR);
  EXPECT_NE (sync.error ().find ("2 frames were lost"), std::string::npos);
}

TEST (Dmdsync, DuplicatesAreDroppedAndLateFramesFlagged)
{
  SyncHarness sync;
  sync.start ();
  for (const int ms : {0, 40, 40, 120, 80, 160})
    ASSERT_EQ (sync.send (guint64 (ms) * kMs), GST_FLOW_OK);

  const std::pair<int, int> expected[] = {
      {0, 0}, {40, 1}, {120, 3}, {80, 2}, {160, 4}};
  for (const auto &[ms, number] : expected) {
    SCOPED_TRACE (ms);
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame);
    EXPECT_EQ (GST_BUFFER_PTS (frame.get ()), guint64 (ms) * kMs);
    EXPECT_EQ (meta_of (frame).frame, guint64 (number));
    EXPECT_EQ (
        has_flag (frame, GST_BUFFER_FLAG_DISCONT), ms != 40 && ms != 160);
  }
  EXPECT_FALSE (sync.pull ());
  EXPECT_EQ (sync.counter ("frames-duplicate"), 1u);
  EXPECT_EQ (sync.counter ("frames-late"), 1u);
  EXPECT_EQ (sync.counter ("frames-lost"), 0u);

  const MessagePtr dropped = sync.element_message ("dmdsync/frame-dropped");
  EXPECT_EQ (string_field (dropped, "reason"), "duplicate");
  EXPECT_EQ (uint64_field (dropped, "frame"), 1u);
  const MessagePtr late = sync.element_message ("dmdsync/frame-late");
  EXPECT_EQ (uint64_field (late, "frame"), 2u);
  EXPECT_EQ (uint64_field (late, "pts"), 80 * kMs);
}

TEST (Dmdsync, TimeThatGoesBackGivesNoNumberTwice)
{
  SyncHarness sync;
  sync.start ();
  for (const int frame : {0, 1, 2, 3, 4, 5, 6, 7, 3, 4, 5})
    ASSERT_EQ (sync.send (sync.time_of (frame)), GST_FLOW_OK);
  for (guint64 number = 0; number < 10; number++) {
    SCOPED_TRACE (number);
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame);
    EXPECT_EQ (meta_of (frame).frame, number);
    EXPECT_EQ (
        has_flag (frame, GST_BUFFER_FLAG_DISCONT), number == 0 || number == 8);
  }
  EXPECT_FALSE (sync.pull ());
  const MessagePtr dropped = sync.element_message ("dmdsync/frame-dropped");
  EXPECT_EQ (string_field (dropped, "reason"), "duplicate");
  EXPECT_EQ (uint64_field (dropped, "frame"), 3u);
}

TEST (Dmdsync, AFrameOfARestartedCameraWithinTheLastExposureIsDropped)
{
  SyncHarness sync;
  sync.start ();
  sync.send_frames (0, 2);
  for (const int ms : {60, 100}) {
    BufferPtr frame = frame_of (
        Image<std::uint8_t> (kSyncWidth, kSyncHeight), guint64 (ms) * kMs);
    if (ms == 60)
      GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_RESYNC);
    ASSERT_EQ (sync.push (std::move (frame)), GST_FLOW_OK);
  }
  for (const GstClockTime ms : {0, 40, 100}) {
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame);
    EXPECT_EQ (GST_BUFFER_PTS (frame.get ()), ms * kMs);
    EXPECT_EQ (has_flag (frame, GST_BUFFER_FLAG_DISCONT), ms != 40);
  }
  EXPECT_EQ (
      string_field (sync.element_message ("dmdsync/frame-dropped"), "reason"),
      "duplicate");
}

TEST (Dmdsync, AFlushIsNotALossAndNumbersGoOn)
{
  SyncHarness sync;
  sync.start ();
  sync.send_frames (0, 2);
  sync.push_event (gst_event_new_flush_start ());
  sync.push_event (gst_event_new_flush_stop (TRUE));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  sync.push_event (gst_event_new_segment (&segment));
  while (sync.pull ())
    ;
  sync.send_frames (50, 52);
  const BufferPtr frame = sync.pull ();
  ASSERT_TRUE (frame);
  EXPECT_EQ (meta_of (frame).frame, 2u);
  EXPECT_TRUE (has_flag (frame, GST_BUFFER_FLAG_DISCONT));
  EXPECT_EQ (sync.counter ("frames-lost"), 0u);
}

TEST (Dmdsync, ReversePlaybackLosesNothing)
{
  SyncHarness sync;
  sync.start ();
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.rate = -1.0;
  segment.stop = 10 * GST_SECOND;
  sync.push_event (gst_event_new_segment (&segment));
  for (const int frame : {9, 8, 7, 4})
    ASSERT_EQ (sync.send (sync.time_of (frame)), GST_FLOW_OK);
  EXPECT_EQ (sync.counter ("frames-lost"), 2u);
  EXPECT_EQ (sync.counter ("frames-late"), 0u);
}

TEST (Dmdsync, ANewStreamIsCountedFromZero)
{
  SyncHarness sync;
  sync.start ();
  sync.send_frames (0, 3);
  sync.push_event (gst_event_new_stream_start ("another"));
  sync.start ();
  while (sync.pull ())
    ;
  sync.send_frames (0, 1);
  const BufferPtr frame = sync.pull ();
  ASSERT_TRUE (frame);
  EXPECT_EQ (meta_of (frame).frame, 0u);
  EXPECT_TRUE (has_flag (frame, GST_BUFFER_FLAG_DISCONT));
}

/* A frame of a buffer pool, whose source waits until it is released. */
BufferPtr
pooled_frame ()
{
  GstVideoInfo info;
  gst_video_info_set_format (
      &info, GST_VIDEO_FORMAT_GRAY8, kSyncWidth, kSyncHeight);
  const CapsPtr caps (gst_video_info_to_caps (&info));
  const ObjectPtr<GstBufferPool> pool (gst_video_buffer_pool_new ());
  GstStructure *config = gst_buffer_pool_get_config (pool.get ());
  gst_buffer_pool_config_set_params (
      config, caps.get (), guint (GST_VIDEO_INFO_SIZE (&info)), 1, 1);
  EXPECT_TRUE (gst_buffer_pool_set_config (pool.get (), config));
  gst_buffer_pool_set_active (pool.get (), TRUE);
  GstBuffer *frame = nullptr;
  gst_buffer_pool_acquire_buffer (pool.get (), &frame, nullptr);
  GST_BUFFER_PTS (frame) = 0;
  gst_buffer_pool_set_active (pool.get (), FALSE);
  return BufferPtr (frame);
}

TEST (Dmdsync, NeverTouchesPixelsOfAPool)
{
  SyncHarness sync;
  sync.start ();
  BufferPtr frame = pooled_frame ();
  GstMemory *memory = gst_buffer_peek_memory (frame.get (), 0);
  /* Another owner has a reference, so the frame must not be written to. */
  const BufferPtr shared (gst_buffer_ref (frame.get ()));
  ASSERT_EQ (sync.push (std::move (frame)), GST_FLOW_OK);
  const BufferPtr out = sync.pull ();
  ASSERT_TRUE (out);
  EXPECT_EQ (gst_buffer_peek_memory (out.get (), 0), memory);
  EXPECT_NE (out.get (), shared.get ());
  EXPECT_FALSE (get_frame_meta (shared.get ()));
}

TEST (Dmdsync, AFrameWithoutTimeIsAnError)
{
  SyncHarness sync;
  sync.start ();
  EXPECT_EQ (sync.send (GST_CLOCK_TIME_NONE), GST_FLOW_ERROR);
  EXPECT_NE (sync.error ().find ("do-timestamp"), std::string::npos);
}

TEST (Dmdsync, SegmentsAreInTime)
{
  SyncHarness sync;
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_BYTES);
  sync.push_event (gst_event_new_segment (&segment));
  EXPECT_NE (sync.error ().find ("counts in bytes"), std::string::npos);
}

TEST (Dmdsync, LatencyMovesMinimumAndMaximumAndIsSaid)
{
  SyncHarness sync ("timestamp-at=arrival exposure-offset=1000000");
  gst_harness_set_upstream_latency (sync.get (), 7 * kMs);
  while (sync.message (GST_MESSAGE_LATENCY))
    ;
  sync.start ();
  EXPECT_TRUE (sync.message (GST_MESSAGE_LATENCY));
  EXPECT_FALSE (sync.message (GST_MESSAGE_LATENCY));
  EXPECT_EQ (gst_harness_query_latency (sync.get ()), 48 * kMs);

  g_object_set (
      sync.element (), "exposure-offset", gint64 (2'000'000), nullptr);
  EXPECT_TRUE (sync.message (GST_MESSAGE_LATENCY));
  EXPECT_EQ (gst_harness_query_latency (sync.get ()), 49 * kMs);
  g_object_set (sync.element (), "on-loss", 0, nullptr);
  EXPECT_FALSE (sync.message (GST_MESSAGE_LATENCY));

  /* A later change of the offset does not cause a loss. */
  sync.send_frames (3, 5);
  g_object_set (
      sync.element (), "exposure-offset", gint64 (50'000'000), nullptr);
  sync.send_frames (5, 7);
  EXPECT_EQ (sync.counter ("frames-lost"), 0u);
}

gboolean
answer_latency (GstPad *pad, GstObject *parent, GstQuery *query)
{
  if (GST_QUERY_TYPE (query) != GST_QUERY_LATENCY)
    return gst_pad_query_default (pad, parent, query);
  gst_query_set_latency (query, TRUE, 10 * kMs, 30 * kMs);
  return TRUE;
}

TEST (Dmdsync, ALatencyThatIsBoundedStaysPossible)
{
  SyncHarness sync ("timestamp-at=arrival");
  gst_pad_set_query_function (sync.get ()->srcpad, answer_latency);
  sync.start ();
  const QueryPtr query (gst_query_new_latency ());
  ASSERT_TRUE (gst_pad_peer_query (sync.get ()->sinkpad, query.get ()));
  gboolean live = FALSE;
  GstClockTime least = 0;
  GstClockTime most = 0;
  gst_query_parse_latency (query.get (), &live, &least, &most);
  EXPECT_TRUE (live);
  EXPECT_EQ (least, 50 * kMs);
  EXPECT_EQ (most, 70 * kMs);
}

TEST (Dmdsync, QosStaysDownstream)
{
  SyncHarness sync;
  sync.start ();
  sync.send_frames (0, 1);
  while (GstEvent *event = gst_harness_try_pull_upstream_event (sync.get ()))
    gst_event_unref (event);
  EXPECT_TRUE (gst_harness_push_upstream_event (sync.get (),
      gst_event_new_qos (GST_QOS_TYPE_UNDERFLOW, 2.0, 40 * GST_MSECOND, 0)));
  EXPECT_FALSE (gst_harness_try_pull_upstream_event (sync.get ()));
  /* It also drops no frame. */
  sync.send_frames (1, 3);
  for (int k = 0; k < 3; k++)
    EXPECT_TRUE (sync.pull ()) << k;
}

TEST (Dmdsync, AGapMovesAsFramesDo)
{
  SyncHarness sync ("timestamp-at=arrival exposure-offset=1000000");
  sync.start ();
  ASSERT_EQ (sync.send (80 * GST_MSECOND), GST_FLOW_OK);
  for (const auto sent : {GST_GAP_FLAG_MISSING_DATA, GstGapFlags (0)}) {
    GstEvent *event = gst_event_new_gap (120 * GST_MSECOND, 40 * GST_MSECOND);
    gst_event_set_gap_flags (event, sent);
    sync.push_event (event);
    const EventPtr gap = sync.pull_event (GST_EVENT_GAP);
    ASSERT_TRUE (gap);
    GstClockTime pts = 0, duration = 0;
    gst_event_parse_gap (gap.get (), &pts, &duration);
    EXPECT_EQ (pts, 79 * GST_MSECOND);
    EXPECT_EQ (duration, 40 * GST_MSECOND);
    GstGapFlags flags = {};
    gst_event_parse_gap_flags (gap.get (), &flags);
    EXPECT_EQ (flags, sent);
  }
}

} // namespace

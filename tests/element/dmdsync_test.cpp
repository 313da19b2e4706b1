/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync without a DMD: time, numbers, losses, flags, tags and queries. */
#include "gstcodedexposuretag.h"
#include "sync_harness.h"

namespace
{

using namespace cexp;
using namespace cexp::test;

const auto *const linked =
    ::testing::AddGlobalTestEnvironment (new LinkedElements);

constexpr GstClockTime kMs = GST_MSECOND;

bool
has_flag (const BufferPtr &buffer, GstBufferFlags flag)
{
  return GST_BUFFER_FLAG_IS_SET (buffer.get (), flag);
}

FrameMeta
meta_of (const BufferPtr &buffer)
{
  const auto meta = get_frame_meta (buffer.get ());
  EXPECT_TRUE (meta);
  return meta.value_or (FrameMeta ());
}

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
    EXPECT_TRUE (meta.locked);
    EXPECT_EQ (meta.slip, 0);
    EXPECT_EQ (meta.lost_before, 0u);
  }
  EXPECT_EQ (sync.get_property<guint64> ("frames-in"), 100u);
  EXPECT_EQ (sync.get_property<guint64> ("frames-lost"), 0u);
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
    EXPECT_TRUE (meta_of (frame).locked);
  }
  EXPECT_EQ (sync.get_property<guint64> ("frames-lost"), 3u);

  const EventPtr gap = sync.pull_event (GST_EVENT_GAP);
  ASSERT_TRUE (gap);
  GstClockTime from = 0;
  GstClockTime length = 0;
  gst_event_parse_gap (gap.get (), &from, &length);
  EXPECT_EQ (from, 80 * kMs);
  EXPECT_EQ (length, 120 * kMs);

  const MessagePtr said = sync.element_message ("dmdsync/frames-lost");
  EXPECT_EQ (uint64_field (said, "count"), 3u);
  EXPECT_EQ (uint64_field (said, "from"), 80 * kMs);
  EXPECT_EQ (uint64_field (said, "to"), 200 * kMs);
  EXPECT_FALSE (sync.element_message ("dmdsync/frames-lost"));
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
  /* The camera source writes the next frame into memory it has handed out. */
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
    EXPECT_FALSE (meta_of (filler).locked);
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
  EXPECT_EQ (sync.get_property<guint64> ("frames-duplicate"), 1u);
  EXPECT_EQ (sync.get_property<guint64> ("frames-late"), 1u);
  EXPECT_EQ (sync.get_property<guint64> ("frames-lost"), 1u);

  const MessagePtr dropped = sync.element_message ("dmdsync/frame-dropped");
  EXPECT_EQ (string_field (dropped, "reason"), "duplicate");
  EXPECT_EQ (uint64_field (dropped, "frame"), 1u);
  const MessagePtr late = sync.element_message ("dmdsync/frame-late");
  EXPECT_EQ (uint64_field (late, "frame"), 2u);
  EXPECT_EQ (uint64_field (late, "pts"), 80 * kMs);
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
  EXPECT_EQ (sync.get_property<guint64> ("frames-lost"), 0u);
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
  EXPECT_EQ (sync.get_property<guint64> ("frames-lost"), 2u);
  EXPECT_EQ (sync.get_property<guint64> ("frames-late"), 0u);
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

TEST (Dmdsync, NeverTouchesPixels)
{
  SyncHarness sync;
  sync.start ();
  BufferPtr frame = frame_of (draw<std::uint8_t> (kSyncWidth, kSyncHeight,
                                  [] (int x, int) { return x; }),
      0);
  GstMemory *memory = gst_buffer_peek_memory (frame.get (), 0);
  /* Somebody else holds the frame, too: it must not be written to. */
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
  EXPECT_NE (sync.error ().find ("TIME"), std::string::npos);
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

  /* Nothing that a later change of the offset moves is a loss. */
  sync.send_frames (3, 5);
  g_object_set (
      sync.element (), "exposure-offset", gint64 (50'000'000), nullptr);
  sync.send_frames (5, 7);
  EXPECT_EQ (sync.get_property<guint64> ("frames-lost"), 0u);
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
  /* And no frame is dropped for it. */
  sync.send_frames (1, 3);
  for (int k = 0; k < 3; k++)
    EXPECT_TRUE (sync.pull ()) << k;
}

std::optional<Schedule>
tagged_schedule (const EventPtr &event)
{
  if (!event)
    return std::nullopt;
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event.get (), &tags);
  const auto schedule = schedule_from_tags (tags);
  if (!schedule || !*schedule)
    return std::nullopt;
  return schedule->value ();
}

TEST (DmdsyncTag, FollowsTheSegmentOnce)
{
  SyncHarness sync ("schedule=staircase:3x3");
  sync.start ();
  EXPECT_EQ (tagged_schedule (sync.pull_event (GST_EVENT_TAG)),
      *Schedule::parse ("staircase:3x3"));
  sync.send_frames (0, 2);
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  sync.push_event (gst_event_new_segment (&segment));
  sync.send_frames (2, 3);
  EXPECT_FALSE (sync.pull_event (GST_EVENT_TAG));
}

TEST (DmdsyncTag, ReplacesAnotherScheduleAndWarnsOnce)
{
  SyncHarness sync ("schedule=staircase:2x2");
  sync.start ();
  ASSERT_TRUE (sync.pull_event (GST_EVENT_TAG));
  for (int time = 0; time < 2; time++) {
    GstTagList *tags =
        schedule_to_tags (*Schedule::parse ("sequential:lattice:5/2"));
    gst_tag_list_add (tags, GST_TAG_MERGE_APPEND, GST_TAG_COMMENT,
        "left half defocused", GST_TAG_TITLE, "milk drop", nullptr);
    sync.push_event (gst_event_new_tag (tags));

    const EventPtr passed = sync.pull_event (GST_EVENT_TAG);
    EXPECT_EQ (tagged_schedule (passed), *Schedule::parse ("staircase:2x2"));
    GstTagList *kept = nullptr;
    gst_event_parse_tag (passed.get (), &kept);
    ASSERT_EQ (gst_tag_list_get_tag_size (kept, GST_TAG_COMMENT), 2u);
    gchar *text = nullptr;
    gst_tag_list_get_string_index (kept, GST_TAG_COMMENT, 1, &text);
    EXPECT_STREQ (CharPtr (text).get (), "left half defocused");
    gst_tag_list_get_string (kept, GST_TAG_TITLE, &text);
    EXPECT_STREQ (CharPtr (text).get (), "milk drop");
  }
  const std::string warning = sync.warning ();
  EXPECT_NE (warning.find ("sequential:lattice:5/2"), std::string::npos);
  EXPECT_NE (warning.find ("staircase:2x2"), std::string::npos);
  EXPECT_EQ (sync.warning (), "");
}

TEST (DmdsyncTag, StaysAmongTagsThatComeLater)
{
  SyncHarness sync ("schedule=staircase:2x2");
  sync.start ();
  sync.push_event (gst_event_new_tag (
      gst_tag_list_new (GST_TAG_TITLE, "milk drop", nullptr)));
  const EventPtr sticky (
      gst_pad_get_sticky_event (sync.get ()->sinkpad, GST_EVENT_TAG, 0));
  EXPECT_EQ (tagged_schedule (sticky), *Schedule::parse ("staircase:2x2"));
  EXPECT_EQ (sync.warning (), "");
}

TEST (DmdsyncTag, TheSameScheduleIsNoReasonToWarn)
{
  SyncHarness sync ("schedule=staircase:2x2");
  sync.start ();
  sync.push_event (schedule_to_event (*Schedule::parse ("staircase:2x2")));
  EXPECT_EQ (sync.warning (), "");
}

TEST (DmdsyncCaps, SlotsThatDoNotFitAreAnErrorWithTheNumbers)
{
  SyncHarness sync ("schedule=staircase:2x2,active=9.8ms,switching=0.2ms");
  sync.start ({25, 1});
  EXPECT_EQ (sync.error (), "");
  sync.start ({26, 1});
  EXPECT_NE (sync.send (0), GST_FLOW_OK);
  const std::string error = sync.error ();
  EXPECT_NE (error.find ("9.8ms"), std::string::npos) << error;
  EXPECT_NE (error.find ("26/1"), std::string::npos) << error;
}

TEST (DmdsyncCaps, ARateThatIsUnknownComesFromTheSlots)
{
  SyncHarness without ("schedule=staircase:2x2");
  without.set_caps ("video/x-raw,format=GRAY8,width=64,height=48");
  EXPECT_NE (without.send (0), GST_FLOW_OK);
  EXPECT_NE (without.error ().find ("framerate=25/1"), std::string::npos);

  SyncHarness with ("schedule=staircase:2x2,active=9.8ms,switching=0.2ms");
  with.set_caps ("video/x-raw,format=GRAY8,width=64,height=48,framerate=0/1");
  ASSERT_EQ (with.send (0), GST_FLOW_OK);
  ASSERT_EQ (with.send (80 * kMs), GST_FLOW_OK);
  EXPECT_EQ (with.error (), "");
  EXPECT_EQ (with.get_property<guint64> ("frames-lost"), 1u);
  const BufferPtr frame = with.pull ();
  ASSERT_TRUE (frame);
  EXPECT_EQ (GST_BUFFER_DURATION (frame.get ()), 40 * kMs);
}

TEST (DmdsyncCaps, AFrameThatCannotHoldThePilotIsAnError)
{
  SyncHarness sync ("schedule=sequential:2x2,pilot=4");
  sync.set_caps (gray_caps (16, 48));
  EXPECT_NE (sync.send (0), GST_FLOW_OK);
  EXPECT_NE (sync.error ().find ("16x48"), std::string::npos);
}

TEST (DmdsyncPhase, TellsWhatCanBeSeen)
{
  const std::pair<const char *, const char *> cases[] = {
      {"sequential:2x2", "never"}, {"staircase:2x2", "in-the-frame"},
      {"s-matrix:7x1", "in-the-frame"}, {"staircase:16x16", "never"},
      {"sequential:2x2,pilot=8", "always"}};
  for (const auto &[schedule, expected] : cases) {
    SCOPED_TRACE (schedule);
    SyncHarness sync ("schedule=" + std::string (schedule));
    GValue value = G_VALUE_INIT;
    g_object_get_property (
        G_OBJECT (sync.element ()), "slip-observable", &value);
    const auto *klass =
        G_ENUM_CLASS (g_type_class_peek (G_VALUE_TYPE (&value)));
    EXPECT_STREQ (g_enum_get_value (const_cast<GEnumClass *> (klass),
                      g_value_get_enum (&value))
                      ->value_nick,
        expected);
    g_value_unset (&value);
    EXPECT_EQ (bool (sync.message (GST_MESSAGE_INFO)),
        std::string (expected) == "never");
  }
}

/** Levels of staircase:2x2 in phase, and with one slot too late from slot 2 on.
 */
constexpr std::array<int, 4> kInPhase{50, 100, 150, 200};
constexpr std::array<int, 4> kSlipped{50, 150, 200, 200};

TEST (DmdsyncPhase, ASlipIsFlaggedInItsFrameAndStaysWithoutADmd)
{
  SyncHarness sync ("schedule=staircase:2x2");
  sync.start ();
  int notified = 0;
  g_signal_connect (sync.element (), "notify::locked",
      G_CALLBACK (+[] (GObject *, GParamSpec *, int *count) { ++*count; }),
      &notified);
  for (int k = 0; k < 6; k++)
    ASSERT_EQ (
        sync.send_levels (sync.time_of (k), k == 3 ? kSlipped : kInPhase),
        GST_FLOW_OK);
  for (int k = 0; k < 6; k++) {
    SCOPED_TRACE (k);
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame);
    EXPECT_EQ (meta_of (frame).locked, k < 3);
    EXPECT_EQ (meta_of (frame).slip, k < 3 ? 0 : 1);
    EXPECT_EQ (has_flag (frame, GST_BUFFER_FLAG_CORRUPTED), k >= 3);
  }
  const MessagePtr locked = sync.element_message ("dmdsync/locked");
  EXPECT_EQ (uint64_field (locked, "frame"), 0u);
  const MessagePtr slip = sync.element_message ("dmdsync/slip");
  EXPECT_EQ (uint64_field (slip, "frame"), 3u);
  EXPECT_EQ (uint64_field (slip, "pts"), 120 * kMs);
  EXPECT_EQ (int_field (slip, "slots"), 1);
  EXPECT_FALSE (sync.element_message ("dmdsync/slip"));
  EXPECT_FALSE (sync.get_property<gboolean> ("locked"));
  EXPECT_EQ (sync.get_property<guint64> ("slips"), 1u);
  EXPECT_EQ (notified, 2) << "locked once, lost once";
}

TEST (DmdsyncPhase, FramesOutOfPhaseCanBeSkipped)
{
  SyncHarness sync ("schedule=staircase:2x2 on-unlock=skip");
  sync.start ();
  for (int k = 0; k < 5; k++)
    ASSERT_EQ (
        sync.send_levels (sync.time_of (k), k == 3 ? kSlipped : kInPhase),
        GST_FLOW_OK);
  int passed = 0;
  while (sync.pull ())
    passed++;
  EXPECT_EQ (passed, 3);
  EXPECT_EQ (sync.counter ("frames-skipped"), 2u);
  EXPECT_EQ (
      string_field (sync.element_message ("dmdsync/frame-dropped"), "reason"),
      "not-locked");
  GstClockTime from = 0;
  const EventPtr gap = sync.pull_event (GST_EVENT_GAP);
  ASSERT_TRUE (gap);
  gst_event_parse_gap (gap.get (), &from, nullptr);
  EXPECT_EQ (from, 120 * kMs);
}

TEST (DmdsyncPhase, FramesOutOfPhaseCanEndTheStream)
{
  SyncHarness sync ("schedule=staircase:2x2 on-unlock=error");
  sync.start ();
  for (int k = 0; k < 3; k++)
    ASSERT_EQ (sync.send_levels (sync.time_of (k), kInPhase), GST_FLOW_OK);
  EXPECT_EQ (sync.send_levels (sync.time_of (3), kSlipped), GST_FLOW_ERROR);
  EXPECT_NE (sync.error ().find ("frame 3"), std::string::npos);
}

TEST (DmdsyncPhase, AOneHotCodeNeverSaysSlip)
{
  SyncHarness sync ("schedule=sequential:2x2");
  sync.start ();
  const std::array<int, 4> doubled{200, 100, 100, 0};
  for (int k = 0; k < 6; k++)
    ASSERT_EQ (sync.send_levels (sync.time_of (k),
                   k == 3 ? doubled : std::array<int, 4>{100, 100, 100, 100}),
        GST_FLOW_OK);
  EXPECT_FALSE (sync.element_message ("dmdsync/slip"));
  EXPECT_TRUE (sync.get_property<gboolean> ("locked"));
}

} // namespace

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-sim: times, gaps, events and tags. */
#include "common/meta.h"
#include "common/tag.h"
#include "schedule_tags.h"
#include "sim_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

void
push_segment (SimHarness &sim, gdouble rate, GstClockTime start)
{
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.rate = rate;
  segment.start = segment.time = start;
  sim.push_event (gst_event_new_segment (&segment));
}

/* PTS of all coded frames there are, in milliseconds, negative where DISCONT.
 */
std::vector<int>
times_of (SimHarness &sim)
{
  std::vector<int> times;
  while (const BufferPtr coded = sim.pull ()) {
    const int ms = int (GST_BUFFER_PTS (coded.get ()) / kMs);
    times.push_back (GST_BUFFER_IS_DISCONT (coded.get ()) ? -ms : ms);
  }
  return times;
}

struct Dropped {
  std::string reason;
  int pts, inputs, needed;
  guint64 all;
  bool operator== (const Dropped &) const = default;
};

std::optional<Dropped>
dropped (SimHarness &sim)
{
  const MessagePtr message =
      sim.element_message ("codedexposure/frame-dropped");
  if (!message)
    return std::nullopt;
  const GstStructure *s = gst_message_get_structure (message.get ());
  Dropped drop;
  drop.reason = gst_structure_get_string (s, "reason");
  guint64 pts = 0;
  EXPECT_TRUE (gst_structure_get (s, "pts", G_TYPE_UINT64, &pts, "inputs",
      G_TYPE_INT, &drop.inputs, "needed", G_TYPE_INT, &drop.needed,
      "frames-dropped", G_TYPE_UINT64, &drop.all, nullptr));
  drop.pts = int (pts / kMs);
  return drop;
}

struct Rate {
  int num, den;
};

class SimRates : public ::testing::TestWithParam<Rate>
{
};

TEST_P (SimRates, CodedFramesAreStampedWithTheirFirstInputFrame)
{
  const auto [num, den] = GetParam ();
  SimHarness sim;
  sim.start (2, 2, 4 * num, den);
  for (int frame = 0; frame < 1000; frame++) {
    sim.send_range (4 * frame, 4 * frame + 4);
    const BufferPtr coded = sim.pull ();
    ASSERT_TRUE (coded);
    ASSERT_EQ (GST_BUFFER_PTS (coded.get ()), sim.time (4 * frame));
    ASSERT_EQ (GST_BUFFER_DTS (coded.get ()), GST_CLOCK_TIME_NONE);
    ASSERT_EQ (GST_BUFFER_DURATION (coded.get ()),
        gst_util_uint64_scale (GST_SECOND, den, num));
    ASSERT_EQ (GST_BUFFER_OFFSET (coded.get ()), guint64 (frame));
    ASSERT_EQ (GST_BUFFER_OFFSET_END (coded.get ()), guint64 (frame) + 1);
    ASSERT_EQ (bool (GST_BUFFER_IS_DISCONT (coded.get ())), frame == 0);
  }
  EXPECT_EQ (sim.counter ("frames-out"), 1000u);
  EXPECT_EQ (sim.counter ("frames-dropped"), 0u);
}

/* Matroska rounds times to ms. */
TEST_P (SimRates, RoundedTimeStampsAreNoGaps)
{
  const auto [num, den] = GetParam ();
  SimHarness sim;
  sim.start (2, 2, 4 * num, den);
  for (int k = 0; k < 400; k++) {
    const GstClockTime rounded = (sim.time (k) + kMs / 2) / kMs * kMs;
    ASSERT_EQ (
        sim.push (frame_of (flat<std::uint8_t> (2, 2, 9), 5 * kMs + rounded)),
        GST_FLOW_OK);
  }
  EXPECT_EQ (sim.counter ("frames-out"), 100u);
  EXPECT_EQ (sim.counter ("frames-dropped"), 0u);
}

TEST_P (SimRates, LatencyIsFromTheFirstInputFrameToTheLast)
{
  const auto [num, den] = GetParam ();
  SimHarness sim;
  gst_harness_set_upstream_latency (sim.get (), 7 * kMs);
  sim.start (2, 2, 4 * num, den);
  EXPECT_TRUE (sim.message (GST_MESSAGE_LATENCY));
  EXPECT_EQ (gst_harness_query_latency (sim.get ()), 7 * kMs + sim.time (3));
}

INSTANTIATE_TEST_SUITE_P (Rates, SimRates,
    ::testing::Values (Rate{25, 1}, Rate{30000, 1001}, Rate{50, 1}));

TEST (SimTime, GapDropsTheExposureAndStartsTheNext)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send_range (0, 6);
  sim.send_range (7, 15);
  EXPECT_EQ (times_of (sim), (std::vector<int>{0, -70, 110}));
  EXPECT_EQ (dropped (sim), (Dropped{"gap", 40, 2, 4, 1}));
  EXPECT_EQ (sim.counter ("frames-dropped"), 1u);
  EXPECT_EQ (sim.warning (),
      "A gap in the input after 2 of 4 input frames of the coded frame at "
      "0:00:00.040000000, which is dropped.");

  sim.send_range (16, 22);
  EXPECT_EQ (dropped (sim), std::nullopt) << "a gap between two exposures";
  sim.send_range (23, 24);
  EXPECT_EQ (dropped (sim), (Dropped{"gap", 200, 2, 4, 2}));
  EXPECT_EQ (sim.warning (), "") << "said once";
  EXPECT_EQ (times_of (sim), (std::vector<int>{-160}));
}

TEST (SimTime, DiscontInAnExposureIsAGap)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send_range (0, 6);
  BufferPtr frame = frame_of (flat<std::uint8_t> (2, 2, 0), sim.time (6));
  GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_DISCONT);
  ASSERT_EQ (sim.push (std::move (frame)), GST_FLOW_OK);
  sim.send_range (7, 14);
  EXPECT_EQ (dropped (sim), (Dropped{"gap", 40, 2, 4, 1}));
  EXPECT_EQ (times_of (sim), (std::vector<int>{0, -60, 100}));
}

TEST (SimTime, TimeThatRunsBackwardsIsAGap)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send_range (100, 106);
  sim.send_range (2, 6);
  EXPECT_EQ (times_of (sim), (std::vector<int>{-1000, -20}));
  EXPECT_EQ (dropped (sim), (Dropped{"gap", 1040, 2, 4, 1}));
}

TEST (SimTime, EndOfStreamDropsWhatIsNotComplete)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send_range (0, 7);
  EXPECT_TRUE (sim.push_event (gst_event_new_eos ()));
  EXPECT_TRUE (sim.pull_event (GST_EVENT_EOS));
  EXPECT_EQ (times_of (sim), (std::vector<int>{0}));
  EXPECT_EQ (dropped (sim), (Dropped{"eos", 40, 3, 4, 1}));
  EXPECT_EQ (sim.warning (), "");
}

TEST (SimTime, EndOfStreamInfoSaysHowFarTheExposureGot)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send_range (0, 7);
  sim.push_event (gst_event_new_eos ());
  const MessagePtr info = sim.message (GST_MESSAGE_INFO);
  ASSERT_TRUE (info);
  gchar *debug = nullptr;
  gst_message_parse_info (info.get (), nullptr, &debug);
  EXPECT_NE (std::string (CharPtr (debug).get ())
                 .find ("ended after 3 of 4 input frames of the coded frame at "
                        "0:00:00.040000000"),
      std::string::npos);
}

TEST (SimTime, CompleteStreamEndsWithoutAWord)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send_range (0, 8);
  sim.push_event (gst_event_new_eos ());
  EXPECT_FALSE (sim.message (GST_MESSAGE_INFO));
  EXPECT_EQ (dropped (sim), std::nullopt);
}

TEST (SimTime, FlushStartsAnew)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send_range (0, 7);
  EXPECT_EQ (times_of (sim), (std::vector<int>{0}));
  sim.push_event (gst_event_new_flush_start ());
  sim.push_event (gst_event_new_flush_stop (TRUE));
  push_segment (sim, 1.0, 90 * kMs);
  sim.send_range (9, 17);
  EXPECT_EQ (dropped (sim), (Dropped{"flush", 40, 3, 4, 1}));
  EXPECT_EQ (times_of (sim), (std::vector<int>{-90, 130}));
  EXPECT_EQ (sim.warning (), "") << "asked for by the application";
}

TEST (SimTime, SegmentStartsAnew)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send_range (0, 5);
  push_segment (sim, 1.0, 0);
  sim.send_range (5, 9);
  EXPECT_EQ (dropped (sim), (Dropped{"segment", 40, 1, 4, 1}));
  EXPECT_EQ (times_of (sim), (std::vector<int>{0, -50}));
}

TEST (SimTime, NewCapsStartAnew)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send_range (0, 6);
  sim.start (6, 4, 200, 1, "GRAY16_LE");
  for (int k = 0; k < 4; k++)
    ASSERT_EQ (sim.push (frame_of (
                   flat<std::uint16_t> (6, 4, 40000), sim.time (12 + k))),
        GST_FLOW_OK);
  EXPECT_EQ (dropped (sim), (Dropped{"caps", 40, 2, 4, 1}));
  sim.pull ();
  EXPECT_EQ (sim.coded<std::uint16_t> (), (flat<std::uint16_t> (6, 4, 40000)));
}

TEST (SimTime, SecondRunKnowsNothingOfTheFirst)
{
  SimHarness sim ("full-well=500");
  std::vector<Image<std::uint8_t>> runs;
  for (int run = 0; run < 2; run++) {
    sim.push_event (gst_event_new_stream_start ("stream"));
    sim.start (20, 20);
    push_segment (sim, 1.0, 0);
    for (int k = 0; k < 6; k++)
      ASSERT_EQ (sim.send (k, 77), GST_FLOW_OK);
    runs.push_back (sim.coded ());
    EXPECT_EQ (sim.counter ("frames-out"), 1u);
    gst_element_set_state (sim.element (), GST_STATE_READY);
    EXPECT_EQ (sim.counter ("frames-out"), 1u) << "until the next run";
    gst_element_set_state (sim.element (), GST_STATE_PLAYING);
    EXPECT_EQ (sim.counter ("frames-out"), 0u);
  }
  EXPECT_EQ (runs[0], runs[1]) << "noise, too, starts anew";
}

TEST (SimTime, CorruptedInputMakesACorruptedFrame)
{
  SimHarness sim;
  sim.start (2, 2);
  for (int k = 0; k < 8; k++) {
    BufferPtr frame = frame_of (flat<std::uint8_t> (2, 2, 0), sim.time (k));
    if (k == 2)
      GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_CORRUPTED);
    sim.push (std::move (frame));
  }
  for (const bool corrupted : {true, false})
    EXPECT_EQ (bool (GST_BUFFER_FLAG_IS_SET (
                   sim.pull ().get (), GST_BUFFER_FLAG_CORRUPTED)),
        corrupted);
}

/* A camera with fewer bits than its format also writes frame numbers. */
TEST (SimTime, ExposuresThatHadNoLightAreCountedWhateverTheJitter)
{
  SimHarness sim ("bits=7");
  sim.start (2, 2);
  struct Numbered {
    guint64 frame, lost_before;
    bool operator== (const Numbered &) const = default;
  };
  std::vector<Numbered> numbers;
  const struct {
    int first;
    GstClockTimeDiff jitter;
  } exposures[] = {{0, 0}, {4, 0}, {12, -2'000'000}, {24, 2'000'000}};
  for (const auto &[first, jitter] : exposures) {
    for (int k = first; k < first + 4; k++)
      ASSERT_EQ (sim.push (frame_of (flat<std::uint8_t> (2, 2, 0),
                     sim.time (guint64 (k)) + GstClockTime (jitter))),
          GST_FLOW_OK);
    const BufferPtr coded = sim.pull ();
    ASSERT_TRUE (coded);
    const auto meta = get_frame_meta (coded.get ());
    ASSERT_TRUE (meta);
    EXPECT_EQ (meta->bits, 7);
    numbers.push_back ({meta->frame, meta->lost_before});
  }
  EXPECT_EQ (numbers, (std::vector<Numbered>{{0, 0}, {1, 0}, {3, 1}, {6, 2}}));
}

/* A seek does not count as a gap. */
TEST (SimTime, NoExposureIsLostInAFlush)
{
  SimHarness sim ("bits=7");
  sim.start (2, 2);
  sim.send_range (0, 4);
  ASSERT_TRUE (sim.pull ());
  sim.push_event (gst_event_new_flush_start ());
  sim.push_event (gst_event_new_flush_stop (TRUE));
  push_segment (sim, 1.0, sim.time (1000));
  sim.send_range (1000, 1004);
  const BufferPtr coded = sim.pull ();
  ASSERT_TRUE (coded);
  const auto meta = get_frame_meta (coded.get ());
  ASSERT_TRUE (meta);
  EXPECT_EQ (meta->frame, 1u);
  EXPECT_EQ (meta->lost_before, 0u);
}

TEST (SimTime, FrameWithoutTimeStampIsAnError)
{
  SimHarness sim;
  sim.start (2, 2);
  EXPECT_EQ (
      sim.push (frame_of (flat<std::uint8_t> (2, 2, 0), GST_CLOCK_TIME_NONE)),
      GST_FLOW_ERROR);
  EXPECT_NE (sim.error ().find ("no time stamp"), std::string::npos);
}

TEST (SimTime, ReversePlaybackIsAnError)
{
  SimHarness sim;
  sim.start (2, 2);
  push_segment (sim, -1.0, 0);
  EXPECT_EQ (sim.send (0), GST_FLOW_ERROR);
  EXPECT_NE (sim.error ().find ("positive rate"), std::string::npos);
}

std::string
schedule_in (GstEvent *event)
{
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event, &tags);
  const auto schedule = schedule_from_tags (tags);
  return schedule && *schedule ? (*schedule)->text () : "";
}

TEST (SimTag, SaysTheScheduleOnceAndBeforeTheFirstFrame)
{
  SimHarness sim ("schedule=staircase:3x3,leak=0.01");
  sim.start (3, 3, 900, 4);
  const EventPtr event = sim.pull_event (GST_EVENT_TAG);
  ASSERT_TRUE (event) << "with the segment";
  EXPECT_EQ (schedule_in (event.get ()), "staircase:3x3,leak=0.01");
  sim.send_range (0, 18);
  push_segment (sim, 1.0, 0);
  sim.send_range (18, 27);
  EXPECT_FALSE (sim.pull_event (GST_EVENT_TAG));
  EXPECT_EQ (sim.counter ("frames-out"), 3u);
}

TEST (SimTag, IsSaidAgainForANewStream)
{
  SimHarness sim;
  sim.start (2, 2);
  EXPECT_TRUE (sim.pull_event (GST_EVENT_TAG));
  sim.push_event (gst_event_new_stream_start ("another"));
  push_segment (sim, 1.0, 0);
  const EventPtr event = sim.pull_event (GST_EVENT_TAG);
  ASSERT_TRUE (event);
  EXPECT_EQ (schedule_in (event.get ()), "sequential:2x2");
}

TEST (SimTag, ANewScheduleIsSaidBeforeItsFirstFrame)
{
  SimHarness sim;
  sim.start (2, 2);
  EXPECT_TRUE (sim.pull_event (GST_EVENT_TAG));
  g_object_set (sim.element (), "schedule", "staircase:2x2", nullptr);
  sim.send_range (0, 3);
  EXPECT_FALSE (sim.pull_event (GST_EVENT_TAG));
  sim.send_range (3, 4);
  const EventPtr event = sim.pull_event (GST_EVENT_TAG);
  ASSERT_TRUE (event);
  EXPECT_EQ (schedule_in (event.get ()), "staircase:2x2");
}

/** The comments in the tags that come out, of all events. */
std::vector<std::string>
comments (SimHarness &sim)
{
  std::vector<std::string> found;
  while (const EventPtr event = sim.pull_event (GST_EVENT_TAG)) {
    GstTagList *tags = nullptr;
    gst_event_parse_tag (event.get (), &tags);
    for (guint i = 0; i < gst_tag_list_get_tag_size (tags, GST_TAG_COMMENT);
         i++) {
      gchar *text = nullptr;
      gst_tag_list_get_string_index (tags, GST_TAG_COMMENT, i, &text);
      found.emplace_back (CharPtr (text).get ());
    }
  }
  return found;
}

/* Coded frames of a scene that was decoded, or is itself coded, are new. */
TEST (SimTag, TheScheduleAndProvenanceOfTheSceneEndHere)
{
  const Schedule other = *Schedule::parse ("staircase:3x3");
  for (const bool early : {true, false})
    for (const GstTagScope scope :
        {GST_TAG_SCOPE_STREAM, GST_TAG_SCOPE_GLOBAL}) {
      SimHarness sim;
      if (!early)
        sim.start (2, 2);
      for (GstEvent *event : {schedule_to_event (other),
               provenance_to_event ({{other}, "select", 0, 0})}) {
        GstTagList *tags = nullptr;
        gst_event_parse_tag (event, &tags);
        GstTagList *scene = gst_tag_list_copy (tags);
        gst_event_unref (event);
        gst_tag_list_set_scope (scene, scope);
        gst_tag_list_add (scene, GST_TAG_MERGE_APPEND, GST_TAG_COMMENT,
            "in the garden", nullptr);
        sim.push_event (gst_event_new_tag (scene));
      }
      if (early)
        sim.start (2, 2);
      sim.send_range (0, 4);
      int own = 0, passed = 0;
      for (const std::string &comment : comments (sim)) {
        const bool ours = comment.starts_with (
            R"(coded-exposure={"format":"coded-exposure","version":1,)"
            R"("tile":"2x2","code":"sequential","size":[2,2],)");
        EXPECT_TRUE (ours || comment == "in the garden") << comment;
        own += ours;
        passed += comment == "in the garden";
      }
      EXPECT_GE (own, 1);
      EXPECT_EQ (passed, 2);
    }
}

TEST (SimTag, TheLastTagsOfTheStreamHaveTheSchedule)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.push_event (
      gst_event_new_tag (gst_tag_list_new (GST_TAG_TITLE, "a clip", nullptr)));
  const EventPtr kept (
      gst_pad_get_sticky_event (sim.get ()->sinkpad, GST_EVENT_TAG, 0));
  ASSERT_TRUE (kept);
  EXPECT_EQ (schedule_in (kept.get ()), "sequential:2x2");
}

TEST (SimTag, AnotherSizeIsSaidBeforeItsFirstFrame)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send_range (0, 4);
  sim.start (4, 2);
  sim.send_range (4, 8);
  EXPECT_EQ (sim.counter ("frames-out"), 2u);
  const std::vector<std::string> said = comments (sim);
  ASSERT_FALSE (said.empty ());
  EXPECT_NE (said.back ().find (R"("size":[4,2])"), std::string::npos)
      << said.back ();
}

TEST (SimTag, TagsOfUpstreamPass)
{
  SimHarness sim;
  sim.start (2, 2);
  EXPECT_TRUE (sim.pull_event (GST_EVENT_TAG));
  sim.push_event (
      gst_event_new_tag (gst_tag_list_new (GST_TAG_TITLE, "a clip", nullptr)));
  EXPECT_TRUE (sim.pull_event (GST_EVENT_TAG));
}

} // namespace

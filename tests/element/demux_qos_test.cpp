/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: latency, late sinks, and queries that count frames. */
#include "harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr GstClockTime kMs = GST_MSECOND;
constexpr char kLine[] = "codedexposure-demux schedule=sequential:2x2";

BufferPtr
coded_frame (GstClockTime pts)
{
  return frame_of (
      draw<std::uint8_t> (16, 16, [] (int x, int y) { return x + y; }), pts);
}

/* Answers queries in the place of upstream. */
struct Upstream {
  explicit Upstream (ElementHarness &demux)
  {
    gst_pad_add_probe (demux.get ()->srcpad, GST_PAD_PROBE_TYPE_QUERY_UPSTREAM,
        answer, this, nullptr);
  }
  static GstPadProbeReturn answer (
      GstPad *, GstPadProbeInfo *info, gpointer user_data)
  {
    GstQuery *query = GST_PAD_PROBE_INFO_QUERY (info);
    const auto &self = *static_cast<Upstream *> (user_data);
    switch (GST_QUERY_TYPE (query)) {
    case GST_QUERY_LATENCY:
      gst_query_set_latency (query, self.live, self.min, self.max);
      return GST_PAD_PROBE_HANDLED;
    case GST_QUERY_DURATION: {
      GstFormat format;
      gst_query_parse_duration (query, &format, nullptr);
      gst_query_set_duration (query, format,
          format == GST_FORMAT_TIME ? gint64 (10 * GST_SECOND) : 250);
      return GST_PAD_PROBE_HANDLED;
    }
    case GST_QUERY_POSITION: {
      GstFormat format;
      gst_query_parse_position (query, &format, nullptr);
      gst_query_set_position (
          query, format, format == GST_FORMAT_TIME ? gint64 (GST_SECOND) : 25);
      return GST_PAD_PROBE_HANDLED;
    }
    default:
      return GST_PAD_PROBE_OK;
    }
  }
  gboolean live = TRUE;
  GstClockTime min = 30 * kMs, max = 70 * kMs;
};

const char *const kPads[] = {"", "subframe_1", "coded"};

class DemuxQos : public ::testing::Test
{
protected:
  void start (const std::string &settings = "")
  {
    demux = std::make_unique<ElementHarness> (kLine + (" " + settings));
    upstream = std::make_unique<Upstream> (*demux);
    demux->request ("subframe_1");
    demux->request ("coded");
    demux->set_caps (gray_caps (16, 16));
  }
  void push (GstClockTime pts)
  {
    ASSERT_EQ (demux->push (coded_frame (pts)), GST_FLOW_OK);
  }
  /** Reports that the sink of @p pad received a buffer of running time @p time
   * late by @p lateness. */
  void report_late (
      GstClockTime time, GstClockTimeDiff lateness, const std::string &pad = "")
  {
    EXPECT_TRUE (gst_harness_push_upstream_event (demux->pad (pad),
        gst_event_new_qos (GST_QOS_TYPE_UNDERFLOW, 1.5, lateness, time)));
  }
  std::vector<int> times (const std::string &pad = "")
  {
    std::vector<int> ms;
    while (const BufferPtr buffer = demux->pull (pad))
      ms.push_back (int (GST_BUFFER_PTS (buffer.get ()) / kMs));
    return ms;
  }
  guint64 counter (const char *name)
  {
    return counter_of (demux->element (), name);
  }
  std::unique_ptr<ElementHarness> demux;
  std::unique_ptr<Upstream> upstream;
};

/* -------------------------------------------------------------- latency -- */

TEST_F (DemuxQos, LatencyIsThatOfUpstreamOnEveryPad)
{
  start ();
  push (0);
  const auto check = [&] (GstClockTime max) {
    for (const char *pad : kPads) {
      const QueryPtr query (gst_query_new_latency ());
      ASSERT_TRUE (
          gst_pad_peer_query (demux->pad (pad)->sinkpad, query.get ()));
      gboolean live = FALSE;
      GstClockTime min = 0, most = 0;
      gst_query_parse_latency (query.get (), &live, &min, &most);
      EXPECT_TRUE (live);
      EXPECT_EQ (min, 30 * kMs) << pad;
      EXPECT_EQ (most, max) << pad;
    }
  };
  check (70 * kMs);
  upstream->max = GST_CLOCK_TIME_NONE;
  check (GST_CLOCK_TIME_NONE);
}

/* -------------------------------------------------------------- lateness -- */

TEST_F (DemuxQos, EventsStopHereAndOthersPass)
{
  start ("qos=true");
  push (0);
  while (GstEvent *event = gst_harness_try_pull_upstream_event (demux->get ()))
    gst_event_unref (event);
  for (const char *pad : kPads)
    report_late (0, 50 * kMs, pad);
  gst_harness_push_upstream_event (demux->get (),
      gst_event_new_navigation (gst_structure_new_empty ("nav")));
  const EventPtr event (gst_harness_try_pull_upstream_event (demux->get ()));
  ASSERT_TRUE (event);
  EXPECT_EQ (GST_EVENT_TYPE (event.get ()), GST_EVENT_NAVIGATION);
}

TEST_F (DemuxQos, NothingIsDroppedUnlessAskedFor)
{
  start ();
  push (0);
  report_late (30 * kMs, 10 * GST_SECOND);
  push (40 * kMs);
  EXPECT_EQ (times (), (std::vector<int>{0, 10, 20, 30, 40, 50, 60, 70}));
  EXPECT_EQ (counter ("subframes-dropped"), 0u);
  EXPECT_FALSE (demux->message (GST_MESSAGE_QOS));
}

TEST_F (DemuxQos, LateSubframesOfOnePadAreLeftOutAndSaid)
{
  start ("qos=true");
  push (0);
  times ();
  times ("subframe_1");
  times ("coded");
  /* The buffer of 40 ms was shown at 65 ms: earlier buffers cannot be in time.
   */
  report_late (40 * kMs, 25 * kMs);
  push (40 * kMs);

  const BufferPtr first = demux->pull ();
  ASSERT_TRUE (first);
  EXPECT_EQ (GST_BUFFER_PTS (first.get ()), 70 * kMs);
  EXPECT_TRUE (GST_BUFFER_IS_DISCONT (first.get ()));
  EXPECT_EQ (times (), std::vector<int>{});
  EXPECT_EQ (times ("subframe_1"), std::vector<int>{50});
  EXPECT_EQ (times ("coded"), std::vector<int>{40});
  EXPECT_EQ (counter ("subframes-dropped"), 3u);
  EXPECT_EQ (counter ("subframes-out"), 5u + 2u);

  for (guint k = 0; k < 3; k++) {
    SCOPED_TRACE (k);
    const EventPtr gap = demux->pull_event (GST_EVENT_GAP);
    ASSERT_TRUE (gap);
    GstClockTime pts, duration;
    gst_event_parse_gap (gap.get (), &pts, &duration);
    EXPECT_EQ (pts, (40 + 10 * k) * kMs);
    EXPECT_EQ (duration, 10 * kMs);

    const MessagePtr message = demux->message (GST_MESSAGE_QOS);
    ASSERT_TRUE (message);
    gboolean live;
    guint64 running, stream, timestamp, length, processed, dropped;
    gst_message_parse_qos (
        message.get (), &live, &running, &stream, &timestamp, &length);
    EXPECT_TRUE (live);
    EXPECT_EQ (running, pts);
    EXPECT_EQ (timestamp, pts);
    EXPECT_EQ (length, duration);
    GstFormat format;
    gst_message_parse_qos_stats (message.get (), &format, &processed, &dropped);
    EXPECT_EQ (format, GST_FORMAT_BUFFERS);
    EXPECT_EQ (processed, 5u);
    EXPECT_EQ (dropped, k + 1);
    gint64 jitter;
    gdouble proportion;
    gst_message_parse_qos_values (
        message.get (), &jitter, &proportion, nullptr);
    EXPECT_EQ (jitter, gint64 (25 * kMs));
    EXPECT_EQ (proportion, 1.5);
  }
  EXPECT_FALSE (demux->message (GST_MESSAGE_QOS));
}

TEST_F (DemuxQos, MessageSaysWhenTheStreamIsNotLive)
{
  start ("qos=true");
  upstream->live = FALSE;
  push (0);
  report_late (40 * kMs, 5 * kMs);
  push (40 * kMs);
  const MessagePtr message = demux->message (GST_MESSAGE_QOS);
  ASSERT_TRUE (message);
  gboolean live = TRUE;
  gst_message_parse_qos (
      message.get (), &live, nullptr, nullptr, nullptr, nullptr);
  EXPECT_FALSE (live);
}

TEST_F (DemuxQos, LatePadOfOneSubframeDoesNotHurtTheOthers)
{
  start ("qos=true");
  push (0);
  times ();
  times ("subframe_1");
  report_late (0, 45 * kMs, "subframe_1");
  report_late (0, GST_SECOND, "coded");
  push (40 * kMs);
  EXPECT_EQ (times (), (std::vector<int>{40, 50, 60, 70}));
  EXPECT_EQ (times ("subframe_1"), std::vector<int>{50});
  report_late (0, 51 * kMs, "subframe_1");
  push (40 * kMs);
  EXPECT_EQ (times ("subframe_1"), std::vector<int>{});
  EXPECT_EQ (times ("coded"), (std::vector<int>{0, 40, 40}))
      << "coded frames are never left out";
}

TEST_F (DemuxQos, AllPadsMayBeLate)
{
  start ("qos=true");
  push (0);
  times ();
  times ("subframe_1");
  report_late (0, GST_SECOND);
  report_late (0, GST_SECOND, "subframe_1");
  push (40 * kMs);
  EXPECT_EQ (times (), std::vector<int>{});
  EXPECT_EQ (times ("subframe_1"), std::vector<int>{});
  EXPECT_EQ (counter ("subframes-dropped"), 5u);
  EXPECT_EQ (counter ("frames-in"), 2u);
}

TEST_F (DemuxQos, LatenessIsInRunningTime)
{
  start ("qos=true");
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.start = segment.time = GST_SECOND;
  segment.base = 5 * GST_SECOND;
  demux->push_event (gst_event_new_segment (&segment));
  push (GST_SECOND);
  times ();
  report_late (5 * GST_SECOND + 40 * kMs, 15 * kMs);
  push (GST_SECOND + 40 * kMs);
  EXPECT_EQ (times (), (std::vector<int>{1060, 1070}));
}

/* In reverse playback, a subframe begins at its end. */
TEST_F (DemuxQos, LatenessIsThatOfTheDirectionOfPlayback)
{
  start ("qos=true");
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.rate = -1.0;
  segment.stop = segment.position = GST_SECOND;
  demux->push_event (gst_event_new_segment (&segment));
  push (960 * kMs);
  times ();
  /* 950 to 960 ms run 40 ms after the start, 920 to 930 ms 70 ms after it. */
  report_late (40 * kMs, 25 * kMs);
  push (920 * kMs);
  EXPECT_EQ (times (), std::vector<int>{920});
  EXPECT_EQ (counter ("subframes-dropped"), 3u);
}

TEST_F (DemuxQos, SegmentAndFlushForgetLateness)
{
  start ("qos=true");
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  for (bool flush : {false, true}) {
    push (0);
    report_late (0, GST_SECOND);
    if (flush) {
      demux->push_event (gst_event_new_flush_start ());
      demux->push_event (gst_event_new_flush_stop (TRUE));
    }
    demux->push_event (gst_event_new_segment (&segment));
    times ();
    push (0);
    EXPECT_EQ (times (), (std::vector<int>{0, 10, 20, 30}));
  }
  EXPECT_EQ (counter ("subframes-dropped"), 0u);
}

/* -------------------------------------------------------------- queries -- */

TEST_F (DemuxQos, FramesAreCountedInSubframesOnSrc)
{
  start ();
  push (0);
  const auto ask = [&] (const char *pad, GstFormat format) {
    gint64 duration = -1, position = -1;
    GstPad *sink = demux->pad (pad)->sinkpad;
    EXPECT_TRUE (gst_pad_peer_query_duration (sink, format, &duration));
    EXPECT_TRUE (gst_pad_peer_query_position (sink, format, &position));
    return std::pair (duration, position);
  };
  EXPECT_EQ (
      ask ("", GST_FORMAT_DEFAULT), std::pair (gint64 (1000), gint64 (100)));
  EXPECT_EQ (ask ("subframe_1", GST_FORMAT_DEFAULT),
      std::pair (gint64 (250), gint64 (25)));
  EXPECT_EQ (ask ("", GST_FORMAT_TIME),
      std::pair (gint64 (10 * GST_SECOND), gint64 (GST_SECOND)));
}

} // namespace

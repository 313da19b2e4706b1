/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: segments, flushes, gaps, the end of a stream, and runs.
 */
#include <optional>

#include "demux_time.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

class DemuxStream : public DemuxTime
{
protected:
  /** On "src"; none: it got no more. */
  std::optional<GstSegment> next_segment ()
  {
    const EventPtr event = demux->pull_event (GST_EVENT_SEGMENT);
    return event ? std::optional (*segment_of (event.get ())) : std::nullopt;
  }
};

TEST_F (DemuxStream, ReversePlaybackGivesTheLastSubframeFirst)
{
  start ();
  push_segment (-1.0, 0, GST_SECOND);
  push_all ({80, 40, 0});
  EXPECT_EQ (discont_times (),
      (std::vector<int>{-110, 100, 90, 80, 70, 60, 50, 40, 30, 20, 10, 0}));
  EXPECT_EQ (counter ("frames-lost"), 0u);
  EXPECT_EQ (demux->warning (), "");
}

TEST_F (DemuxStream, LossInReversePlaybackIsFound)
{
  start ();
  push_segment (-1.0, 0, GST_SECOND);
  push_all ({160, 40});
  EXPECT_EQ (counter ("frames-lost"), 2u);
  EXPECT_EQ (discont_times (),
      (std::vector<int>{-190, 180, 170, 160, -70, 60, 50, 40}));
}

TEST_F (DemuxStream, FlushForgetsTimeAndMarksANewBeginning)
{
  start ();
  demux->request ("coded");
  push_all ({0, 40});
  pull_all ();
  pull_all ("coded");

  ASSERT_TRUE (demux->push_event (gst_event_new_flush_start ()));
  ASSERT_TRUE (demux->push_event (gst_event_new_flush_stop (TRUE)));
  push_segment (1.0, 10 * GST_SECOND, GST_CLOCK_TIME_NONE);
  push (10 * GST_SECOND);

  EXPECT_EQ (discont_times (), (std::vector<int>{-10000, 10010, 10020, 10030}));
  const auto coded = pull_all ("coded");
  ASSERT_EQ (coded.size (), 1u);
  EXPECT_TRUE (discont (coded[0]));
  EXPECT_EQ (counter ("frames-lost"), 0u);
  EXPECT_EQ (demux->warning (), "");
  for (const char *pad : {"", "coded"}) {
    EXPECT_TRUE (demux->pull_event (GST_EVENT_FLUSH_START, pad));
    EXPECT_TRUE (demux->pull_event (GST_EVENT_FLUSH_STOP, pad));
    EXPECT_TRUE (demux->pull_event (GST_EVENT_SEGMENT, pad));
  }
}

TEST_F (DemuxStream, NewSegmentIsGivenOnUnchangedAndNoLoss)
{
  start ();
  push_all ({0});
  pull_all ();
  while (demux->pull_event (GST_EVENT_SEGMENT))
    ;
  push_segment (1.0, 5 * GST_SECOND, 9 * GST_SECOND);
  push (5 * GST_SECOND);
  EXPECT_EQ (counter ("frames-lost"), 0u);
  EXPECT_EQ (discont_times (), (std::vector<int>{-5000, 5010, 5020, 5030}));
  const auto segment = next_segment ();
  ASSERT_TRUE (segment);
  EXPECT_EQ (segment->start, 5 * GST_SECOND);
  EXPECT_EQ (segment->stop, 9 * GST_SECOND);
}

TEST_F (DemuxStream, SegmentThatAFlushEndedIsNeverSeenDownstream)
{
  start ();
  push_segment (1.0, 0, 5 * GST_SECOND);
  ASSERT_TRUE (demux->push_event (gst_event_new_flush_start ()));
  ASSERT_TRUE (demux->push_event (gst_event_new_flush_stop (TRUE)));
  push_segment (1.0, 10 * GST_SECOND, GST_CLOCK_TIME_NONE);
  push (10 * GST_SECOND);

  EXPECT_EQ (discont_times (), (std::vector<int>{-10000, 10010, 10020, 10030}));
  const auto segment = next_segment ();
  ASSERT_TRUE (segment);
  EXPECT_EQ (segment->start, 10 * GST_SECOND);
  EXPECT_FALSE (demux->pull_event (GST_EVENT_SEGMENT));
}

TEST_F (DemuxStream, SegmentThatIsNotInTimeIsAnError)
{
  start ();
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_BYTES);
  demux->push_event (gst_event_new_segment (&segment));
  EXPECT_NE (demux->error ().find ("counts in bytes"), std::string::npos);
  EXPECT_EQ (demux->push (coded_frame (0)), GST_FLOW_ERROR);
}

TEST_F (DemuxStream, GapEventReachesEveryPadBehindItsCaps)
{
  start ();
  demux->request ("subframe_0");
  demux->request ("subframe_2");
  demux->request ("coded");
  demux->push_event (gst_event_new_gap (0, 40 * kMs));
  for (const char *pad : {"", "subframe_0", "subframe_2", "coded"}) {
    ASSERT_TRUE (demux->pull_event (GST_EVENT_CAPS, pad)) << pad;
    const EventPtr gap = demux->pull_event (GST_EVENT_GAP, pad);
    ASSERT_TRUE (gap) << pad;
    GstClockTime time, duration;
    gst_event_parse_gap (gap.get (), &time, &duration);
    /* When its subframe would have come. */
    EXPECT_EQ (time, pad == std::string ("subframe_2") ? 20 * kMs : 0);
    EXPECT_EQ (duration, 40 * kMs);
  }
}

TEST_F (DemuxStream, EosReachesEveryPad)
{
  start ();
  demux->request ("coded");
  demux->request ("subframe_3");
  push (0);
  ASSERT_TRUE (demux->push_event (gst_event_new_eos ()));
  for (const char *pad : {"", "coded", "subframe_3"})
    EXPECT_TRUE (demux->pull_event (GST_EVENT_EOS, pad)) << pad;
}

TEST_F (DemuxStream, EosBeforeAnyFrameReachesEveryPadBehindItsCaps)
{
  start ();
  demux->request ("subframe_3");
  ASSERT_TRUE (demux->push_event (gst_event_new_eos ()));
  for (const char *pad : {"", "subframe_3"}) {
    EXPECT_TRUE (demux->pull_event (GST_EVENT_CAPS, pad)) << pad;
    EXPECT_TRUE (demux->pull_event (GST_EVENT_SEGMENT, pad)) << pad;
    EXPECT_TRUE (demux->pull_event (GST_EVENT_EOS, pad)) << pad;
  }
  EXPECT_EQ (demux->error (), "");
}

TEST_F (DemuxStream, StreamWithoutCapsEndsAndTheNextOneIsPlayed)
{
  demux = std::make_unique<ElementHarness> (
      "codedexposure-demux schedule=sequential:2x2");
  demux->push_event (gst_event_new_stream_start ("empty"));
  demux->push_event (gst_event_new_gap (0, 40 * kMs));
  ASSERT_TRUE (demux->push_event (gst_event_new_eos ()));
  EXPECT_TRUE (demux->pull_event (GST_EVENT_EOS));

  demux->push_event (gst_event_new_stream_start ("full"));
  demux->set_caps (gray_caps (16, 16));
  push (0);
  EXPECT_EQ (pull_all ().size (), 4u);
}

/* As upstream sends its sticky events again, but not the segment. */
TEST_F (DemuxStream, SegmentBeforeTheStreamStartHoldsForItsFrames)
{
  start ();
  push_segment (1.0, 3 * GST_SECOND, 9 * GST_SECOND);
  demux->push_event (gst_event_new_stream_start ("again"));
  push (3 * GST_SECOND);
  EXPECT_EQ (discont_times (), (std::vector<int>{-3000, 3010, 3020, 3030}));
  const auto segment = next_segment ();
  ASSERT_TRUE (segment);
  EXPECT_EQ (segment->start, 3 * GST_SECOND);
}

TEST_F (DemuxStream, SecondRunKnowsNothingOfTheFirst)
{
  start ();
  demux->request ("subframe_0");
  push_all ({0, 400});
  EXPECT_EQ (counter ("frames-in"), 2u);
  EXPECT_EQ (counter ("frames-lost"), 9u);
  pull_all ();
  pull_all ("subframe_0");

  gst_element_set_state (demux->element (), GST_STATE_READY);
  EXPECT_EQ (counter ("frames-in"), 2u) << "a run is counted until the next";
  gst_element_set_state (demux->element (), GST_STATE_PLAYING);
  EXPECT_EQ (counter ("frames-in"), 0u);
  EXPECT_EQ (counter ("frames-lost"), 0u);
  EXPECT_EQ (text_property (demux->element (), "schedule-in-force"), "");

  demux->push_event (gst_event_new_stream_start ("again"));
  demux->set_caps (gray_caps (8, 8, "50/1"));
  push_segment (1.0, 0, GST_CLOCK_TIME_NONE);
  ASSERT_EQ (demux->push (coded_frame (0, 8, 8)), GST_FLOW_OK);
  const auto subframes = pull_all ();
  ASSERT_EQ (subframes.size (), 4u);
  EXPECT_EQ (GST_BUFFER_OFFSET (subframes[0].get ()), 0u);
  EXPECT_EQ (get_frame_meta (subframes[0].get ())->frame, 0u);
  EXPECT_TRUE (discont (subframes[0]));
  EXPECT_EQ (pts_of (subframes[1]), 5 * kMs);
  EXPECT_EQ (pull_all ("subframe_0").size (), 1u);
  EXPECT_EQ (counter ("frames-in"), 1u);
  EXPECT_EQ (counter ("subframes-out"), 5u);
}

TEST_F (DemuxStream, StatsHoldAllCountersAtOneMoment)
{
  start ();
  push_all ({0, 120});
  const StructurePtr stats (
      property<GstStructure *> (demux->element (), "stats"));
  EXPECT_STREQ (CharPtr (gst_structure_to_string (stats.get ())).get (),
      "application/x-codedexposure-demux-stats, frames-in=(guint64)2, "
      "subframes-out=(guint64)8, frames-lost=(guint64)2, "
      "frames-corrupted=(guint64)0, frames-not-coded=(guint64)0, "
      "subframes-dropped=(guint64)0, "
      "saturated-frames=(guint64)0, mirrors-exact=(guint64)0, "
      "mirrors-weighted=(guint64)0, mirrors-mixed=(guint64)0, "
      "mirrors-unseen=(guint64)0;");
}

} // namespace

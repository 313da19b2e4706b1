/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: time stamps, losses, flags and metas of frames. */
#include "demux_time.h"

#include "common/messages.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

struct RateCase {
  const char *name;
  const char *schedule;
  const char *rate;
  int subframes;
  int num, den;
};

class DemuxRates : public ::testing::TestWithParam<RateCase>
{
};

INSTANTIATE_TEST_SUITE_P (Rates, DemuxRates,
    ::testing::Values (RateCase{"n4_25", "sequential:2x2", "25/1", 4, 25, 1},
        RateCase{"n8_25", "sequential:lattice:8/3", "25/1", 8, 25, 1},
        RateCase{"n9_25", "sequential:3x3", "25/1", 9, 25, 1},
        RateCase{"n4_ntsc", "sequential:2x2", "30000/1001", 4, 30000, 1001},
        RateCase{
            "n8_ntsc", "sequential:lattice:8/3", "30000/1001", 8, 30000, 1001},
        RateCase{"n9_ntsc", "sequential:3x3", "30000/1001", 9, 30000, 1001}),
    [] (const auto &info) { return info.param.name; });

/* Subframe times count from the PTS of their coded frame: an offset and jitter
 * must be preserved to the ns. */
TEST_P (DemuxRates, SlotsTileTheFrameFromItsOwnTimeStamp)
{
  const RateCase &c = GetParam ();
  ElementHarness demux (
      std::string ("codedexposure-demux schedule=") + c.schedule);
  demux.request ("subframe_1");
  demux.set_caps (gray_caps (24, 24, c.rate));
  const auto boundary = [&] (int k) {
    return gst_util_uint64_scale (GST_SECOND, guint64 (k) * guint64 (c.den),
        guint64 (c.num) * guint64 (c.subframes));
  };

  guint64 offset = 0;
  for (guint64 frame = 0; frame < 3; frame++) {
    const GstClockTime anchor =
        3600 * GST_SECOND + frame * boundary (c.subframes) + frame * 7;
    ASSERT_EQ (demux.push (coded_frame (anchor, 24, 24)), GST_FLOW_OK);
    for (int k = 0; k < c.subframes; k++, offset++) {
      SCOPED_TRACE (::testing::Message () << "frame " << frame << " k " << k);
      const BufferPtr sub = demux.pull ();
      ASSERT_TRUE (sub);
      EXPECT_EQ (pts_of (sub), anchor + boundary (k));
      EXPECT_EQ (duration_of (sub), boundary (k + 1) - boundary (k));
      EXPECT_EQ (GST_BUFFER_DTS (sub.get ()), GST_CLOCK_TIME_NONE);
      EXPECT_EQ (GST_BUFFER_OFFSET (sub.get ()), offset);
      EXPECT_EQ (GST_BUFFER_OFFSET_END (sub.get ()), offset + 1);
      EXPECT_EQ (discont (sub), offset == 0);
      const auto meta = get_frame_meta (sub.get ());
      ASSERT_TRUE (meta);
      EXPECT_EQ (meta->frame, frame);
      EXPECT_EQ (meta->subframe, k);
      /* The light is counted in whole nanoseconds from a period that was
       * rounded already. */
      EXPECT_NEAR (
          double (meta->exposure_start - anchor), double (boundary (k)), 1.0);
    }
    EXPECT_FALSE (demux.pull ());

    const BufferPtr one = demux.pull ("subframe_1");
    ASSERT_TRUE (one);
    EXPECT_EQ (pts_of (one), anchor + boundary (1));
    EXPECT_EQ (duration_of (one), boundary (c.subframes));
    EXPECT_EQ (GST_BUFFER_OFFSET (one.get ()), frame);
    EXPECT_EQ (GST_BUFFER_OFFSET_END (one.get ()), frame + 1);
    EXPECT_EQ (discont (one), frame == 0);
    EXPECT_FALSE (demux.pull ("subframe_1"));
  }
}

/* As the first frames of a camera, until its clock is known. */
TEST_F (DemuxTime, FramesThatComeEarlyGiveNoPictureBeforeAnother)
{
  start ();
  push_all ({0, 20, 40, 80});
  std::vector<GstClockTime> shown, light; // us
  for (const BufferPtr &buffer : pull_all ()) {
    shown.push_back (pts_of (buffer) / GST_USECOND);
    light.push_back (
        get_frame_meta (buffer.get ())->exposure_start / GST_USECOND);
  }
  EXPECT_EQ (shown, (std::vector<GstClockTime>{0, 10'000, 20'000, 30'000,
                        30'625, 31'250, 40'000, 50'000, 50'625, 51'250, 60'000,
                        70'000, 80'000, 90'000, 100'000, 110'000}));
  EXPECT_EQ (light, (std::vector<GstClockTime>{0, 10'000, 20'000, 30'000,
                        20'000, 30'000, 40'000, 50'000, 40'000, 50'000, 60'000,
                        70'000, 80'000, 90'000, 100'000, 110'000}));
}

/* The slots of the reference bench: 4 x (9.8 ms + 0.2 ms). */
TEST_F (DemuxTime, MetaHoldsTheLightNotTheSlot)
{
  start ("schedule=\"sequential:2x2,active=9.8ms,switching=0.2ms\"");
  push (0);
  const auto subframes = pull_all ();
  ASSERT_EQ (subframes.size (), 4u);
  for (guint k = 0; k < 4; k++) {
    const auto meta = get_frame_meta (subframes[k].get ());
    ASSERT_TRUE (meta);
    EXPECT_EQ (meta->exposure_start, k * 10 * kMs);
    EXPECT_EQ (meta->exposure_duration, 9800 * GST_USECOND);
    EXPECT_EQ (duration_of (subframes[k]), 10 * kMs);
  }
}

TEST_F (DemuxTime, LightOfAStaircaseGrowsUnlessItIsDecoded)
{
  const auto lengths = [this] (const std::string &method) {
    start ("schedule=staircase:2x2 method=" + method);
    push (0);
    std::vector<GstClockTime> ms;
    for (const BufferPtr &buffer : pull_all ()) {
      const auto meta = get_frame_meta (buffer.get ());
      ms.push_back (meta->exposure_duration / kMs);
    }
    return ms;
  };
  EXPECT_EQ (lengths ("select"), (std::vector<GstClockTime>{10, 20, 30, 40}));
  EXPECT_EQ (lengths ("rank"), (std::vector<GstClockTime>{10, 20, 30, 40}));
  EXPECT_EQ (lengths ("decode"), (std::vector<GstClockTime>{10, 10, 10, 10}));
}

TEST_F (DemuxTime, RankOfEqualExposuresKnowsNoSlot)
{
  start ("schedule=sequential:2x2 method=rank");
  push (80 * kMs);
  for (const BufferPtr &buffer : pull_all ()) {
    const auto meta = get_frame_meta (buffer.get ());
    EXPECT_EQ (meta->exposure_start, 80 * kMs);
    EXPECT_EQ (meta->exposure_duration, 40 * kMs);
  }
}

TEST_F (DemuxTime, LostFrameIsMarkedNotStretched)
{
  start ();
  demux->request ("coded");
  demux->request ("subframe_2");
  push_all ({0, 80});

  EXPECT_EQ (
      discont_times (), (std::vector<int>{-1, 10, 20, 30, -80, 90, 100, 110}));
  const auto coded = pull_all ("coded");
  ASSERT_EQ (coded.size (), 2u);
  EXPECT_TRUE (discont (coded[1]));
  const auto third = pull_all ("subframe_2");
  ASSERT_EQ (third.size (), 2u);
  EXPECT_TRUE (discont (third[1]));
  EXPECT_EQ (counter ("frames-lost"), 1u);
  EXPECT_EQ (get_frame_meta (third[1].get ())->frame, 2u);
  EXPECT_EQ (get_frame_meta (third[1].get ())->lost_before, 1u);
}

TEST_F (DemuxTime, LossIsSaidOnTheBusWithItsPlace)
{
  start ("schedule=sequential:2x2", "30000/1001");
  const GstClockTime period = 33366666;
  push (GST_SECOND);
  push (GST_SECOND + 4 * period);

  const auto lost = demux->posted<FramesLost> ();
  ASSERT_TRUE (lost);
  EXPECT_EQ (lost->count, 3u);
  EXPECT_EQ (lost->from, GST_SECOND + period);
  EXPECT_EQ (lost->to, GST_SECOND + 4 * period);
  EXPECT_FALSE (demux->posted<FramesLost> ());
  EXPECT_EQ (counter ("frames-lost"), 3u);
}

/* dmdsync posts a loss and pushes a gap in its place. */
TEST_F (DemuxTime, LossThatUpstreamHasSaidIsCountedAndNotSaidAgain)
{
  start ();
  push (0);
  GstEvent *gap = gst_event_new_gap (40 * kMs, 80 * kMs);
  gst_event_set_gap_flags (gap, GST_GAP_FLAG_MISSING_DATA);
  ASSERT_TRUE (demux->push_event (gap));
  push (120 * kMs);
  EXPECT_FALSE (demux->posted<FramesLost> ());
  EXPECT_EQ (counter ("frames-lost"), 2u);
  push (200 * kMs);
  EXPECT_TRUE (demux->posted<FramesLost> ());
}

/* So does the element that restores the metas of a recording. */
TEST_F (DemuxTime, LossThatTheMetaHasIsCountedAndNotSaidAgain)
{
  start ();
  const auto push_frame = [this] (GstClockTime pts, guint64 told) {
    BufferPtr frame = frame_of (Image<std::uint8_t> (16, 16), pts);
    set_frame_meta (frame.get (), {.lost_before = told});
    ASSERT_EQ (demux->push (std::move (frame)), GST_FLOW_OK);
  };
  push_frame (0, 0);
  push_frame (120 * kMs, 2);
  EXPECT_FALSE (demux->posted<FramesLost> ());
  EXPECT_EQ (counter ("frames-lost"), 2u);
  push_frame (240 * kMs, 1);
  EXPECT_TRUE (demux->posted<FramesLost> ());
}

TEST_F (DemuxTime, JitterUpToHalfAPeriodIsNoLoss)
{
  start ();
  push_all ({0, 60, 80, 140});
  EXPECT_EQ (counter ("frames-lost"), 0u);
  EXPECT_FALSE (demux->posted<FramesLost> ());
  EXPECT_EQ (demux->warning (), "");
  push (140 * kMs + 60 * kMs + 1);
  EXPECT_EQ (counter ("frames-lost"), 1u);
}

TEST_F (DemuxTime, TimeThatRunsBackwardsIsANewBeginningAndWarnedOfOnce)
{
  start ();
  push_all ({400, 0, 40, 80, 0});
  EXPECT_EQ (
      discont_times (), (std::vector<int>{-400, 410, 420, 430, -1, 10, 20, 30,
                            40, 50, 60, 70, 80, 90, 100, 110, -1, 10, 20, 30}));
  EXPECT_EQ (counter ("frames-lost"), 0u);
  EXPECT_NE (demux->warning ().find ("0:00:00.400000000"), std::string::npos);
  EXPECT_EQ (demux->warning (), "");
}

TEST_F (DemuxTime, NumbersAreNotReusedWhenTimeRunsBackwards)
{
  start ();
  push_all ({0, 40, 80, 120, 160, 200, 0, 40, 80});
  EXPECT_EQ (
      frame_numbers (), (std::vector<guint64>{0, 1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST_F (DemuxTime, FrameAfterALateOneIsANewBeginning)
{
  start ();
  push_all ({0, 40, 120, 80, 160});
  EXPECT_EQ (discont_times (),
      (std::vector<int>{-1, 10, 20, 30, 40, 50, 60, 70, -120, 130, 140, 150,
          -80, 90, 100, 110, -160, 170, 180, 190}));
}

TEST_F (DemuxTime, FrameThatComesTwiceIsMarkedAndHasOneNumber)
{
  start ();
  push_all ({0, 40, 41, 80});
  EXPECT_EQ (frame_numbers (), (std::vector<guint64>{0, 1, 1, 2}));
  EXPECT_NE (demux->warning (), "");
  EXPECT_EQ (counter ("frames-lost"), 0u);
}

TEST_F (DemuxTime, NumbersGoOnWhenTheRateChanges)
{
  start ();
  push_all ({0, 40});
  demux->set_caps (gray_caps (16, 16, "50/1"));
  push_all ({80, 140});
  EXPECT_EQ (frame_numbers (), (std::vector<guint64>{0, 1, 2, 5}));
}

TEST_F (DemuxTime, FramesOfASlowerRateKeepTheirTimes)
{
  start ("schedule=sequential:2x2", "50/1");
  push_all ({0, 20});
  demux->push_event (
      gst_event_new_caps (caps_of (gray_caps (16, 16, "25/1")).get ()));
  push (40 * kMs);
  std::vector<GstClockTime> shown; // ms
  for (const BufferPtr &buffer : pull_all ())
    shown.push_back (pts_of (buffer) / kMs);
  EXPECT_EQ (shown, (std::vector<GstClockTime>{
                        0, 5, 10, 15, 20, 25, 30, 35, 40, 50, 60, 70}));
}

TEST_F (DemuxTime, FrameWithoutTimeStampIsAnError)
{
  start ();
  EXPECT_EQ (demux->push (coded_frame (GST_CLOCK_TIME_NONE)), GST_FLOW_ERROR);
  EXPECT_NE (demux->error ().find ("PTS"), std::string::npos);
  EXPECT_FALSE (demux->pull ());
}

TEST_F (DemuxTime, FrameOfATimeThatIsTooFarIsAnError)
{
  start ();
  push (0);
  const GstClockTime pts = GstClockTime (1) << 63;
  EXPECT_EQ (demux->push (coded_frame (pts)), GST_FLOW_ERROR);
  EXPECT_NE (demux->error ().find (std::to_string (pts) + " ns, but none may"),
      std::string::npos);
}

TEST_F (DemuxTime, UpstreamDiscontIsGivenOnOnce)
{
  start ();
  push (0);
  BufferPtr frame = coded_frame (40 * kMs);
  GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_DISCONT);
  GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_RESYNC);
  GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_MARKER);
  ASSERT_EQ (demux->push (std::move (frame)), GST_FLOW_OK);
  const auto subframes = pull_all ();
  ASSERT_EQ (subframes.size (), 8u);
  for (std::size_t i = 4; i < 8; i++) {
    GstBuffer *buffer = subframes[i].get ();
    EXPECT_EQ (GST_BUFFER_IS_DISCONT (buffer), i == 4);
    EXPECT_EQ (
        bool (GST_BUFFER_FLAG_IS_SET (buffer, GST_BUFFER_FLAG_RESYNC)), i == 4);
    EXPECT_FALSE (GST_BUFFER_FLAG_IS_SET (buffer, GST_BUFFER_FLAG_MARKER));
  }
  EXPECT_EQ (counter ("frames-lost"), 0u);
}

TEST_F (DemuxTime, CorruptedFrameMakesCorruptedSubframesAndIsCounted)
{
  start ();
  push (0);
  BufferPtr frame = coded_frame (40 * kMs);
  GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_CORRUPTED);
  ASSERT_EQ (demux->push (std::move (frame)), GST_FLOW_OK);
  push (80 * kMs);
  std::size_t i = 0;
  for (const BufferPtr &buffer : pull_all ()) {
    EXPECT_EQ (bool (GST_BUFFER_FLAG_IS_SET (
                   buffer.get (), GST_BUFFER_FLAG_CORRUPTED)),
        i / 4 == 1)
        << i;
    i++;
  }
  EXPECT_EQ (i, 12u);
  EXPECT_EQ (counter ("frames-corrupted"), 1u);
}

TEST_F (DemuxTime, GapFrameMakesGapSubframes)
{
  start ();
  BufferPtr frame = coded_frame (0);
  GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_GAP);
  ASSERT_EQ (demux->push (std::move (frame)), GST_FLOW_OK);
  const auto subframes = pull_all ();
  ASSERT_EQ (subframes.size (), 4u);
  for (const BufferPtr &buffer : subframes)
    EXPECT_TRUE (GST_BUFFER_FLAG_IS_SET (buffer.get (), GST_BUFFER_FLAG_GAP));
}

TEST_F (DemuxTime, MetaOfTheFrameIsKept)
{
  start ();
  BufferPtr frame = coded_frame (0);
  FrameMeta given;
  given.frame = 1234;
  given.locked = true;
  given.slip = -2;
  given.lost_before = 5;
  set_frame_meta (frame.get (), given);
  ASSERT_EQ (demux->push (std::move (frame)), GST_FLOW_OK);
  const auto subframes = pull_all ();
  ASSERT_EQ (subframes.size (), 4u);
  for (guint k = 0; k < 4; k++) {
    const auto meta = get_frame_meta (subframes[k].get ());
    ASSERT_TRUE (meta);
    EXPECT_EQ (meta->frame, 1234u);
    EXPECT_EQ (meta->subframe, int (k));
    EXPECT_EQ (meta->locked, true);
    EXPECT_EQ (meta->slip, -2);
    EXPECT_EQ (meta->lost_before, 5u);
    EXPECT_EQ (meta->exposure_start, k * 10 * kMs);
    EXPECT_EQ (meta->exposure_duration, 10 * kMs);
  }
}

} // namespace

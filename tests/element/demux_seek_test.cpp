/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux after a decoder that clips frames to the segment, as all
 * decoders do: exactly the requested subframes are pushed, at their original
 * times. */
#include "common/messages.h"
#include "common/meta.h"
#include "harness.h"
#include "schedule/timing.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr GstClockTime kStreamEnd = 2 * GST_SECOND;

/** The time of a frame in a recording. */
GstClockTime
recorded (const FrameRate &rate, int number)
{
  return (GstClockTime (rate.time_of (number)) + 500) / 1000 * 1000;
}

class DemuxSeek : public ::testing::TestWithParam<FrameRate>
{
protected:
  DemuxSeek () : demux ("codedexposure-demux schedule=sequential:2x2")
  {
    gst_pad_set_query_function (
        demux.get ()->srcpad,
        +[] (GstPad *pad, GstObject *parent, GstQuery *query) {
          if (GST_QUERY_TYPE (query) != GST_QUERY_DURATION)
            return gst_pad_query_default (pad, parent, query);
          gst_query_set_duration (query, GST_FORMAT_TIME, kStreamEnd);
          return gboolean (TRUE);
        });
    demux.request ("coded");
    demux.set_caps (gray_caps (
        16, 16, std::to_string (rate.num) + "/" + std::to_string (rate.den)));
  }
  /** Frames @p first to @p last, as a decoder pushes them for a segment from @p
   * from to @p to. */
  void decode (int first, int last, GstClockTime from, GstClockTime to)
  {
    GstSegment segment;
    gst_segment_init (&segment, GST_FORMAT_TIME);
    segment.start = segment.position = from;
    segment.stop = to;
    ASSERT_TRUE (demux.push_event (gst_event_new_segment (&segment)));
    for (int i = first; i <= last; i++) {
      const GstClockTime pts = recorded (rate, i);
      guint64 begin, end;
      if (!gst_segment_clip (
              &segment, GST_FORMAT_TIME, pts, pts + period, &begin, &end))
        continue;
      BufferPtr frame = frame_of (
          draw<std::uint8_t> (16, 16, [i] (int, int) { return i; }), begin);
      GST_BUFFER_DURATION (frame.get ()) = end - begin;
      ASSERT_EQ (demux.push (std::move (frame)), GST_FLOW_OK);
    }
  }
  /** (frame number, subframe) of all pushed subframes; their times are those
   * without a seek. */
  std::vector<std::pair<int, int>> subframes ()
  {
    std::vector<std::pair<int, int>> all;
    while (const BufferPtr out = demux.pull ()) {
      const int i =
          image_of<std::uint8_t> (out.get (), demux.pad_caps ().get ())
              .at (0, 0);
      const int k = get_frame_meta (out.get ())->subframe;
      all.emplace_back (i, k);
      EXPECT_NEAR (double (GST_BUFFER_PTS (out.get ())),
          double (recorded (rate, i) + period * GstClockTime (k) / 4), 1000)
          << i << ", " << k;
    }
    return all;
  }
  int coded_frames ()
  {
    int count = 0;
    while (demux.pull ("coded"))
      count++;
    return count;
  }

  const FrameRate rate = GetParam ();
  const GstClockTime period = GstClockTime (rate.period ());
  ElementHarness demux;
};

INSTANTIATE_TEST_SUITE_P (Rates, DemuxSeek,
    ::testing::Values (FrameRate{25, 1}, FrameRate{30000, 1001}),
    [] (const auto &info) { return std::to_string (info.param.num); });

using Subframes = std::vector<std::pair<int, int>>;

} // namespace

TEST_P (DemuxSeek, WithinFramesGivesWhatWasAskedFor)
{
  decode (9, 13, recorded (rate, 10) + period * 5 / 8,
      recorded (rate, 12) + period * 3 / 8);
  EXPECT_EQ (subframes (), (Subframes{{10, 2}, {10, 3}, {11, 0}, {11, 1},
                               {11, 2}, {11, 3}, {12, 0}, {12, 1}}));
  EXPECT_EQ (coded_frames (), 3);
  EXPECT_EQ (counter_of (demux.element (), "frames-lost"), 0u);
  EXPECT_EQ (demux.warning (), "");
}

/* It can be recorded or decoded again like any other. */
TEST_P (DemuxSeek, CodedFrameThatBeginsBeforeTheSegmentIsWhole)
{
  decode (9, 13, recorded (rate, 10) + period * 5 / 8,
      recorded (rate, 12) + period * 3 / 8);
  const BufferPtr first = demux.pull ("coded");
  ASSERT_TRUE (first);
  EXPECT_NEAR (double (GST_BUFFER_PTS (first.get ())),
      double (recorded (rate, 10)), 1000);
  EXPECT_EQ (GST_BUFFER_DURATION (first.get ()), period);
}

/* Recorded times are rounded: a nanosecond of the frame before, or of the one
 * behind, may lie within. */
TEST_P (DemuxSeek, ToTheTimesOfFramesGivesTheseFramesAlone)
{
  for (int i = 1; i < 20; i++) {
    decode (i - 1, i + 3, recorded (rate, i), recorded (rate, i + 2));
    EXPECT_EQ (
        subframes (), (Subframes{{i, 0}, {i, 1}, {i, 2}, {i, 3}, {i + 1, 0},
                          {i + 1, 1}, {i + 1, 2}, {i + 1, 3}}));
    EXPECT_EQ (coded_frames (), 2) << i;
  }
  EXPECT_EQ (demux.warning (), "");
}

TEST_P (DemuxSeek, IntoTheLastFrameGivesTheRestOfIt)
{
  const int last = int (kStreamEnd / period) - 1;
  decode (last, last, recorded (rate, last) + period * 5 / 8,
      recorded (rate, last) + period);
  if (rate.den != 1) // this stream ends elsewhere
    return;
  EXPECT_EQ (subframes (), (Subframes{{last, 2}, {last, 3}}));
  EXPECT_EQ (demux.warning (), "");
}

TEST_P (DemuxSeek, WithinOneFrameIsWarnedOfAndGivesNothing)
{
  decode (9, 11, recorded (rate, 10) + period / 4,
      recorded (rate, 10) + period / 2);
  EXPECT_EQ (subframes (), Subframes ());
  EXPECT_NE (
      demux.warning ().find ("Seek to a longer segment"), std::string::npos);
}

/* Sources set DURATION to 0, or to the distance from the frame before. */
TEST_P (DemuxSeek, AShortDurationOfAWholeFirstFrameDoesNotMatter)
{
  for (const GstClockTime duration : {0, 1, 10000, 20000, 4000000}) {
    decode (0, -1, 0, GST_CLOCK_TIME_NONE);
    BufferPtr frame = frame_of (Image<std::uint8_t> (16, 16), 0);
    GST_BUFFER_DURATION (frame.get ()) = duration;
    ASSERT_EQ (demux.push (std::move (frame)), GST_FLOW_OK);
    EXPECT_EQ (subframes (), (Subframes{{0, 0}, {0, 1}, {0, 2}, {0, 3}}))
        << duration;
    EXPECT_EQ (coded_frames (), 1);
  }
}

/* A microsecond at the start of a segment looks like the rest of a clipped
 * frame; the next frame tells. */
TEST_P (DemuxSeek, AFirstFrameThatWasTakenForARestIsLost)
{
  const GstClockTime start = 5 * period;
  for (const bool whole : {false, true}) {
    decode (0, -1, start, GST_CLOCK_TIME_NONE);
    const GstClockTime next = start + (whole ? period : 1000);
    for (const GstClockTime pts : {start, next}) {
      BufferPtr frame = frame_of (Image<std::uint8_t> (16, 16), pts);
      GST_BUFFER_DURATION (frame.get ()) = pts == start ? 1000 : period;
      ASSERT_EQ (demux.push (std::move (frame)), GST_FLOW_OK);
    }
    EXPECT_EQ (coded_frames (), 1);
    const auto lost = demux.posted<FramesLost> ();
    EXPECT_EQ (lost.value_or (FramesLost ()).count, guint64 (whole));
  }
}

/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames that show a pattern, or a switch to or from one, are not decoded. */
#include "harness.h"

#include "common/messages.h"
#include "common/meta.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
const std::vector<std::string> kShown{
    "", "", kSwitch, "dark", "dark", kSwitch, "white", kSwitch, "", ""};

/** An element that gets a frame for each of kShown. */
class PatternFrames : public ::testing::TestWithParam<const char *>
{
protected:
  ElementHarness filter{GetParam ()};

  void push_all ()
  {
    filter.set_caps (gray_caps (16, 16));
    for (std::size_t k = 0; k < kShown.size (); k++) {
      BufferPtr frame = frame_of (
          draw<std::uint8_t> (16, 16, [] (int x, int y) { return x + y; }),
          k * kPeriod);
      set_frame_meta (frame.get (), {.frame = k, .pattern = kShown[k]});
      ASSERT_EQ (filter.push (std::move (frame)), GST_FLOW_OK);
    }
    filter.push_event (gst_event_new_eos ());
  }
};

INSTANTIATE_TEST_SUITE_P (Filters, PatternFrames,
    ::testing::Values ("codedexposure-demux schedule=sequential:2x2",
        "codedexposure-fuse schedule=sequential:2x2",
        "codedexposure-fuse schedule=sequential:2x2 lookahead=1"));

} // namespace

TEST_P (PatternFrames, FramesGiveWayToAGapOfTheirTime)
{
  push_all ();
  std::map<guint64, int> pictures;
  while (const BufferPtr picture = filter.pull ()) {
    const guint64 frame = get_frame_meta (picture.get ())->frame;
    const bool is_first = pictures[frame]++ == 0;
    EXPECT_EQ (GST_BUFFER_IS_DISCONT (picture.get ()),
        is_first && (frame == 0 || frame == 8))
        << frame;
  }
  EXPECT_EQ (
      pictures, (std::map<guint64, int>{{0, 4}, {1, 4}, {8, 4}, {9, 4}}));
  for (guint64 k = 2; k < 8; k++) {
    const EventPtr gap = filter.pull_event (GST_EVENT_GAP);
    ASSERT_TRUE (gap) << k;
    GstClockTime from = 0, duration = 0;
    gst_event_parse_gap (gap.get (), &from, &duration);
    EXPECT_EQ (from, k * kPeriod);
    EXPECT_EQ (duration, kPeriod);
  }
  EXPECT_FALSE (filter.pull_event (GST_EVENT_GAP));
}

TEST_P (PatternFrames, FramesAreCountedAndEachPatternIsSaidOnce)
{
  push_all ();
  EXPECT_EQ (counter_of (filter.element (), "frames-in"), kShown.size ());
  EXPECT_EQ (counter_of (filter.element (), "frames-not-coded"), 6u);
  const std::pair<const char *, guint64> said[] = {
      {kSwitch, 2}, {"dark", 3}, {"white", 6}};
  for (const auto &[pattern, frame] : said) {
    const auto message = filter.posted<NotCoded> ();
    ASSERT_TRUE (message);
    EXPECT_EQ (message->pattern, pattern);
    EXPECT_EQ (message->frame, frame);
    EXPECT_EQ (message->from, frame * kPeriod);
  }
  EXPECT_FALSE (filter.posted<NotCoded> ());
}

/* What a pad gets covers its time without a hole, subframes and gaps alike. */
TEST (PatternFramesDemux, TheCodedPadHandsEveryFrameOn)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  for (const char *pad : {"coded", "subframe_1", "subframe_3"})
    demux.request (pad);
  demux.set_caps (gray_caps (16, 16));
  for (std::size_t k = 0; k < kShown.size (); k++) {
    BufferPtr frame = frame_of (Image<std::uint8_t> (16, 16), k * kPeriod);
    set_frame_meta (frame.get (), {.frame = k, .pattern = kShown[k]});
    ASSERT_EQ (demux.push (std::move (frame)), GST_FLOW_OK);
  }
  for (std::size_t k = 0; k < kShown.size (); k++) {
    const BufferPtr coded = demux.pull ("coded");
    ASSERT_TRUE (coded) << k;
    EXPECT_EQ (get_frame_meta (coded.get ())->pattern, kShown[k]);
    EXPECT_EQ (GST_BUFFER_IS_DISCONT (coded.get ()), k == 0);
  }
  EXPECT_FALSE (demux.pull_event (GST_EVENT_GAP, "coded"));
  for (const auto &[pad, slot] :
      {std::pair{"subframe_1", 1u}, {"subframe_3", 3u}})
    for (std::size_t k = 0; k < kShown.size (); k++) {
      SCOPED_TRACE (testing::Message () << pad << ", frame " << k);
      GstClockTime from = 0, duration = 0;
      if (kShown[k].empty ()) {
        const BufferPtr subframe = demux.pull (pad);
        ASSERT_TRUE (subframe);
        from = GST_BUFFER_PTS (subframe.get ());
        duration = GST_BUFFER_DURATION (subframe.get ());
      } else {
        const EventPtr gap = demux.pull_event (GST_EVENT_GAP, pad);
        ASSERT_TRUE (gap);
        gst_event_parse_gap (gap.get (), &from, &duration);
      }
      EXPECT_EQ (from, k * kPeriod + slot * kPeriod / 4);
      EXPECT_EQ (duration, kPeriod);
    }
}

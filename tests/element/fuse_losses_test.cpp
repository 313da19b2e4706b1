/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-fuse: frames that wait for the next one, and what is compared
 * with what after losses, flushes and damaged frames. */
#include "fuse_harness.h"

#include "common/messages.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

/* ------------------------------------------------------------ lookahead -- */

TEST_F (Fuse, AddsNoLatencyByDefault)
{
  start ();
  push (0);
  EXPECT_EQ (pull_all ().size (), 4u);
  EXPECT_EQ (min_latency (), 5 * GST_MSECOND);
}

TEST_F (Fuse, LookaheadWaitsForAFrameAndSaysSo)
{
  start ("schedule=sequential:lattice:4/2 lookahead=1");
  push (0);
  EXPECT_TRUE (pull_all ().empty ());
  EXPECT_TRUE (fuse->message (GST_MESSAGE_LATENCY));
  EXPECT_EQ (min_latency (), 45 * GST_MSECOND);
  push (1);
  push (2);
  ASSERT_TRUE (fuse->push_event (gst_event_new_eos ()));
  FuseOptions options;
  options.lookahead = 1;
  EXPECT_EQ (
      pull_images (), expected ("sequential:lattice:4/2", {0, 1, 2}, options));
}

TEST_F (Fuse, ALossIsDiscontAlsoBehindWhatWaits)
{
  start ("schedule=sequential:lattice:4/2 lookahead=1");
  push (0);
  push (2, 2 * kPeriod);
  ASSERT_TRUE (fuse->push_event (gst_event_new_eos ()));
  EXPECT_EQ (disconts (), (std::vector<std::size_t>{0, 4}));
}

TEST_F (Fuse, WhatWaitsGoesBeforeTheEnd)
{
  start ("schedule=sequential:lattice:4/2 lookahead=1");
  push (0);
  ASSERT_TRUE (fuse->push_event (gst_event_new_eos ()));
  EXPECT_EQ (pull_all ().size (), 4u);
  EXPECT_TRUE (fuse->pull_event (GST_EVENT_EOS));
}

TEST_F (Fuse, AFlushDropsWhatWaits)
{
  start ("schedule=sequential:lattice:4/2 lookahead=1");
  push (0);
  flush ();
  push_segment ();
  push (7, 0);
  ASSERT_TRUE (fuse->push_event (gst_event_new_eos ()));
  EXPECT_EQ (pull_images (), expected ("sequential:lattice:4/2", {7}));
}

/* A flush cancels the current frame, but not later ones. */
TEST_F (Fuse, FusesAgainAfterAFlush)
{
  start ("schedule=sequential:2x2 quality=balanced threads=2");
  push (0);
  pull_all ();
  flush ();
  push_segment ();
  push (7, 0);
  FuseOptions options;
  options.quality = FuseQuality::kBalanced;
  EXPECT_EQ (pull_images (), expected ("sequential:2x2", {7}, options));
}

/* --------------------------------------------------------------- losses -- */

TEST_F (Fuse, ALossIsSaidAndStartsHistoryAnew)
{
  start ();
  push (0);
  push (0, kPeriod);
  push (0, 4 * kPeriod);
  const auto lost = fuse->posted<FramesLost> ();
  ASSERT_TRUE (lost);
  EXPECT_EQ (lost->count, 2u);
  EXPECT_EQ (counter_of (fuse->element (), "frames-lost"), 2u);
  const auto images = pull_images ();
  ASSERT_EQ (images.size (), 12u);
  /* The second frame detects static pixels; the third restarts the comparison.
   */
  EXPECT_NE (images[4], images[0]);
  for (std::size_t k = 0; k < 4; k++)
    EXPECT_EQ (images[8 + k], images[k]);
}

TEST_F (Fuse, LossesAndBreaksAreDiscont)
{
  start ();
  push (0);
  push (1);
  push (2, 4 * kPeriod);
  push (3, 5 * kPeriod, GST_BUFFER_FLAG_DISCONT);
  push (4, 6 * kPeriod);
  EXPECT_EQ (disconts (), (std::vector<std::size_t>{0, 8, 12}));
}

TEST_F (Fuse, ANewSegmentIsNoLoss)
{
  for (const bool with_flush : {false, true}) {
    start ();
    push (0);
    push (0, kPeriod);
    if (with_flush)
      flush ();
    push_segment (10 * GST_SECOND);
    push (0, 10 * GST_SECOND);
    EXPECT_EQ (counter_of (fuse->element (), "frames-lost"), 0u);
    EXPECT_FALSE (fuse->posted<FramesLost> ());
    const CapsPtr caps = fuse->pad_caps ();
    const auto all = pull_all ();
    ASSERT_EQ (all.size (), 12u);
    EXPECT_TRUE (GST_BUFFER_IS_DISCONT (all[8].get ()));
    EXPECT_EQ (image_of<std::uint8_t> (all[8].get (), caps.get ()),
        image_of<std::uint8_t> (all[0].get (), caps.get ()))
        << "it is compared with nothing";
  }
}

TEST_F (Fuse, DamagedFramesPassTheirFlagsAndAreNotCompared)
{
  start ();
  push (0);
  push (0, kPeriod, GST_BUFFER_FLAG_CORRUPTED);
  push (0, 2 * kPeriod);
  const auto all = pull_all ();
  ASSERT_EQ (all.size (), 12u);
  const CapsPtr caps = fuse->pad_caps ();
  for (std::size_t i = 0; i < all.size (); i++) {
    EXPECT_EQ (bool (GST_BUFFER_FLAG_IS_SET (
                   all[i].get (), GST_BUFFER_FLAG_CORRUPTED)),
        i / 4 == 1);
    EXPECT_EQ (image_of<std::uint8_t> (all[i].get (), caps.get ()),
        image_of<std::uint8_t> (all[i % 4].get (), caps.get ()));
  }
}

/* What comes after a frame was exposed before it. */
TEST_F (Fuse, ComparesNothingAtANegativeRate)
{
  start ("schedule=sequential:lattice:4/2 lookahead=1");
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.rate = -1.0;
  segment.stop = segment.position = GST_SECOND;
  ASSERT_TRUE (fuse->push_event (gst_event_new_segment (&segment)));
  for (const int number : {2, 1, 0}) {
    push (number);
    auto alone = expected ("sequential:lattice:4/2", {number});
    std::reverse (alone.begin (), alone.end ());
    EXPECT_EQ (pull_images (), alone) << number;
  }
}

TEST_F (Fuse, CountsDamagedFrames)
{
  start ();
  push (0);
  push (1, kPeriod, GST_BUFFER_FLAG_CORRUPTED);
  EXPECT_EQ (counter_of (fuse->element (), "frames-corrupted"), 1u);
}

TEST_F (Fuse, ALateFrameIsSaidAndComparedWithNothing)
{
  start ();
  push (0);
  push (0, 3 * kPeriod);
  push (0, kPeriod);
  push (0, 4 * kPeriod);
  EXPECT_NE (fuse->warning ().find ("overlaps"), std::string::npos);
  EXPECT_EQ (disconts (), (std::vector<std::size_t>{0, 4, 8, 12}));
}

} // namespace

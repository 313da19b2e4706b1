/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-fuse: pixels, times, schedules and buffers. */
#include "fuse_harness.h"

#include "common/messages.h"
#include "common/meta.h"
#include "common/tag.h"
#include "downstream.h"
#include "schedule_tags.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

/* --------------------------------------------------------------- pixels -- */

TEST_F (Fuse, GivesWhatTheLibraryGives)
{
  start ();
  push (0);
  push (1);
  EXPECT_EQ (pull_images (), expected ("sequential:lattice:4/2", {0, 1}));
}

TEST_F (Fuse, TakesSixteenBitsAndNoiseAndQuality)
{
  start ("schedule=sequential:2x2 quality=balanced full-well=10000 "
         "read-noise=5 bits=16",
      "25/1", "GRAY16_LE");
  for (int number : {0, 1})
    ASSERT_EQ (fuse->push (frame_of (picture<std::uint16_t> (number),
                   GstClockTime (number) * kPeriod)),
        GST_FLOW_OK);
  FuseOptions options;
  options.quality = FuseQuality::kBalanced;
  options.noise = {10000.0, 5.0};
  options.bits = 16;
  EXPECT_EQ (pull_images<std::uint16_t> (),
      expected<std::uint16_t> ("sequential:2x2", {0, 1}, options));
}

TEST_F (Fuse, TakesTheBitsThatFramesSay)
{
  start ("schedule=sequential:lattice:4/2", "25/1", "GRAY16_LE");
  const auto twelve = draw<std::uint16_t> (kWidth, kHeight,
      [] (int x, int y) { return (x / 3 + y / 2) % 2 ? 4095 : 0; });
  BufferPtr frame = frame_of (twelve, 0);
  set_frame_meta (frame.get (), {.bits = 12});
  ASSERT_EQ (fuse->push (std::move (frame)), GST_FLOW_OK);
  int largest = 0;
  for (const auto &image : pull_images<std::uint16_t> ())
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++)
        largest = std::max (largest, int (image.at (x, y)));
  EXPECT_EQ (largest, 4095);
}

TEST_F (Fuse, ReadsStridesOfItsInput)
{
  start ();
  const Image<std::uint8_t> image = picture (0);
  BufferPtr wide (gst_buffer_new_allocate (nullptr, 64 * kHeight, nullptr));
  gsize offset[GST_VIDEO_MAX_PLANES] = {0};
  gint stride[GST_VIDEO_MAX_PLANES] = {64};
  gst_buffer_add_video_meta_full (wide.get (), GST_VIDEO_FRAME_FLAG_NONE,
      GST_VIDEO_FORMAT_GRAY8, kWidth, kHeight, 1, offset, stride);
  for (int y = 0; y < kHeight; y++)
    gst_buffer_fill (
        wide.get (), gsize (64 * y), image.view ().row (y), kWidth);
  GST_BUFFER_PTS (wide.get ()) = 0;
  ASSERT_EQ (fuse->push (std::move (wide)), GST_FLOW_OK);
  EXPECT_EQ (pull_images (), expected ("sequential:lattice:4/2", {0}));
}

/* ---------------------------------------------------------------- times -- */

TEST_F (Fuse, FramesFollowInEvenSteps)
{
  start ();
  push (0);
  push (1);
  const auto all = pull_all ();
  ASSERT_EQ (all.size (), 8u);
  for (std::size_t i = 0; i < all.size (); i++) {
    EXPECT_EQ (GST_BUFFER_PTS (all[i].get ()), i * 10 * GST_MSECOND);
    EXPECT_EQ (GST_BUFFER_DURATION (all[i].get ()), 10 * GST_MSECOND);
    EXPECT_EQ (GST_BUFFER_OFFSET (all[i].get ()), i);
  }
}

TEST_F (Fuse, TimesAreExactAtBrokenRates)
{
  start ("schedule=sequential:lattice:8/3", "30000/1001");
  const GstClockTime first = 1234567;
  push (0, first);
  push (1, first + 33366666);
  const auto all = pull_all ();
  ASSERT_EQ (all.size (), 16u);
  /* floor (k 1001 s / 30000 / 8) */
  const GstClockTime starts[] = {0, 4170833, 8341666, 12512500, 16683333,
      20854166, 25025000, 29195833, 33366666};
  for (std::size_t k = 0; k < 8; k++) {
    EXPECT_EQ (GST_BUFFER_PTS (all[k].get ()), first + starts[k]);
    EXPECT_EQ (GST_BUFFER_DURATION (all[k].get ()), starts[k + 1] - starts[k]);
    EXPECT_EQ (
        GST_BUFFER_PTS (all[8 + k].get ()), first + 33366666 + starts[k]);
  }
}

TEST_F (Fuse, MetaSaysWhenTheLightOfAFrameFell)
{
  start ("schedule=sequential:2x2,active=9ms,switching=500us");
  push (0);
  push (1);
  const auto all = pull_all ();
  const auto meta = get_frame_meta (all[6].get ());
  ASSERT_TRUE (meta);
  EXPECT_EQ (meta->frame, 1u);
  EXPECT_EQ (meta->subframe, 2);
  EXPECT_EQ (meta->exposure_start, kPeriod + 2 * 9500 * GST_USECOND);
  EXPECT_EQ (meta->exposure_duration, 9 * GST_MSECOND);
}

TEST_F (Fuse, NeedsTimeStamps)
{
  start ();
  EXPECT_EQ (
      fuse->push (frame_of (picture (0), GST_CLOCK_TIME_NONE)), GST_FLOW_ERROR);
  EXPECT_NE (fuse->error ().find ("do-timestamp"), std::string::npos);
}

/* ------------------------------------------------- schedules and caps -- */

TEST_F (Fuse, RegionsBecomeOnePictureAtTheHighestRate)
{
  const char *schedule = "sequential:lattice:4/2,region=8x8+8+4:sequential:4x2";
  start ("schedule=" + std::string (schedule));
  push (0);
  push (1);
  EXPECT_TRUE (same_caps (
      fuse->pad_caps ().get (), gray_caps (kWidth, kHeight, "200/1")));
  EXPECT_EQ (pull_images (), expected (schedule, {0, 1}));
}

TEST_F (Fuse, SaysWhichRegionTheFrameDoesNotHold)
{
  start ("schedule=sequential:2x2,region=8x8+20+4:sequential:4x2");
  EXPECT_EQ (fuse->push (frame_of (picture (0), 0)), GST_FLOW_NOT_NEGOTIATED);
  EXPECT_NE (fuse->error ().find ("region 0, 8x8+20+4"), std::string::npos);
}

TEST_F (Fuse, RateIsRaisedSizeStaysAndThePilotIsCropped)
{
  start ("schedule=sequential:lattice:4/2,pilot=4");
  push (0);
  EXPECT_TRUE (same_caps (
      fuse->pad_caps ().get (), gray_caps (kWidth, kHeight - 4, "100/1")));
  EXPECT_EQ (pull_all ().size (), 4u);
}

TEST_F (Fuse, ScheduleComesFromTheTagUnlessThePropertySays)
{
  start ("");
  fuse->push_event (schedule_to_event (schedule_of ("sequential:lattice:5/2")));
  push (0);
  EXPECT_EQ (text_property (fuse->element (), "schedule-in-force"),
      "sequential:lattice:5/2");
  EXPECT_EQ (pull_images (), expected ("sequential:lattice:5/2", {0}));
  EXPECT_EQ (fuse->warning (), "");

  start ("schedule=sequential:2x2");
  fuse->push_event (schedule_to_event (schedule_of ("sequential:lattice:5/2")));
  push (0);
  EXPECT_EQ (pull_images (), expected ("sequential:2x2", {0}));
}

TEST_F (Fuse, WarnsWhereItHasToAssumeASchedule)
{
  start ("");
  push (0);
  push (1);
  EXPECT_NE (
      fuse->warning ().find ("assuming sequential:2x2"), std::string::npos);
  EXPECT_EQ (fuse->warning (), "");
}

TEST_F (Fuse, WarnsOfARangeForOneCamera)
{
  start ("schedule=sequential:2x2 range=2");
  push (0);
  EXPECT_NE (fuse->warning ().find (
                 "Range 2 makes the pictures darker and shows no more light"),
      std::string::npos);
}

TEST_F (Fuse, FramesWithDarkBetweenThemDoNotOverlap)
{
  FuseOptions options;
  options.lookahead = 1;
  const auto alone = expected ("sequential:2x2", {0, 1, 2}, options);
  options.overlap = 2;
  const auto both = expected ("sequential:2x2", {0, 1, 2}, options);
  EXPECT_FALSE (both == alone);
  const auto fused = [&] (const std::string &times) {
    start ("schedule=sequential:2x2" + times + " lookahead=1 overlap=2");
    for (int number : {0, 1, 2})
      push (number);
    fuse->push_event (gst_event_new_eos ());
    return pull_images ();
  };
  EXPECT_TRUE (fused (",active=9.8ms,switching=200us") == both);
  EXPECT_EQ (fuse->warning (), "");
  EXPECT_TRUE (fused (",active=9ms,readout=3ms") == alone);
  EXPECT_EQ (fuse->warning (),
      "The exposures between coded frames are not used: there is no light for "
      "4ms from one exposure to the next; it must be a quarter of a slot at "
      "most, 2.25ms. Leave overlap at 1.");
}

TEST_F (Fuse, OverlapNeedsTheNextFrame)
{
  start ("schedule=sequential:2x2 overlap=2");
  EXPECT_EQ (fuse->push (frame_of (picture (0), 0)), GST_FLOW_NOT_NEGOTIATED);
  EXPECT_NE (fuse->error ().find ("set lookahead to 1"), std::string::npos);
}

TEST_F (Fuse, RefusesMotionForMoreSlotsThanItCan)
{
  start ("schedule=sequential:lattice:25/10 quality=best");
  EXPECT_EQ (fuse->push (frame_of (picture (0), 0)), GST_FLOW_NOT_NEGOTIATED);
  EXPECT_NE (fuse->error ().find ("quality=fast"), std::string::npos);
}

TEST_F (Fuse, NeedsARateFromSomewhere)
{
  start ("schedule=sequential:2x2", "0/1");
  EXPECT_EQ (fuse->push (frame_of (picture (0), 0)), GST_FLOW_NOT_NEGOTIATED);
  EXPECT_NE (fuse->error ().find ("frame-rate=25/1"), std::string::npos);

  start ("schedule=sequential:2x2 frame-rate=25/1", "0/1");
  push (0);
  EXPECT_EQ (pull_all ().size (), 4u);
}

TEST_F (Fuse, ANewQualityHoldsFromTheNextFrameOn)
{
  start ();
  push (0);
  fuse->pull_event (GST_EVENT_CAPS);
  gst_util_set_object_arg (G_OBJECT (fuse->element ()), "quality", "balanced");
  push (1);
  EXPECT_EQ (pull_all ().size (), 8u);
  EXPECT_FALSE (fuse->pull_event (GST_EVENT_CAPS));
}

/* ----------------------------------------------------------- saturation -- */

TEST_F (Fuse, SaysWhenFramesAreSaturated)
{
  start ("schedule=sequential:2x2", "25/1", "GRAY16_LE");
  const auto white = draw<std::uint16_t> (
      kWidth, kHeight, [] (int x, int y) { return x + y == 0 ? 4095 : 100; });
  const auto grey =
      draw<std::uint16_t> (kWidth, kHeight, [] (int, int) { return 4094; });
  const auto push_twelve = [&] (const auto &image, int i) {
    BufferPtr frame = frame_of (image, GstClockTime (i) * kPeriod);
    set_frame_meta (frame.get (), {.bits = 12});
    ASSERT_EQ (fuse->push (std::move (frame)), GST_FLOW_OK);
  };
  push_twelve (grey, 0);
  EXPECT_FALSE (fuse->posted<Saturated> ());
  push_twelve (white, 1);
  const auto saturated = fuse->posted<Saturated> ();
  ASSERT_TRUE (saturated);
  EXPECT_EQ (saturated->pixels, 1u);
  EXPECT_EQ (counter_of (fuse->element (), "saturated-frames"), 1u);
}

TEST_F (Fuse, FramesThatFillAGapAreNotCountedAsSaturated)
{
  start ();
  const auto white =
      draw<std::uint8_t> (kWidth, kHeight, [] (int, int) { return 255; });
  BufferPtr filler = frame_of (white, 0);
  GST_BUFFER_FLAG_SET (filler.get (), GST_BUFFER_FLAG_GAP);
  ASSERT_EQ (fuse->push (std::move (filler)), GST_FLOW_OK);
  EXPECT_EQ (counter_of (fuse->element (), "saturated-frames"), 0u);
  EXPECT_FALSE (fuse->posted<Saturated> ());
}

/* ---------------------------------------------------------- allocation -- */

TEST_F (Fuse, BuffersComeFromThePoolOfDownstreamAndItIsAskedAgain)
{
  start ();
  Downstream downstream (fuse->get ());
  downstream.pool.reset (gst_video_buffer_pool_new ());
  push (0);
  push (1);
  EXPECT_EQ (downstream.queries, 1);
  for (int k = 0; k < 8; k++)
    EXPECT_EQ (fuse->pull ()->pool, downstream.pool.get ());

  const ObjectPtr<GstBufferPool> other (gst_video_buffer_pool_new ());
  downstream.pool.reset (GST_BUFFER_POOL (gst_object_ref (other.get ())));
  gst_harness_push_upstream_event (fuse->get (), gst_event_new_reconfigure ());
  push (2);
  EXPECT_EQ (downstream.queries, 2);
  EXPECT_EQ (fuse->pull ()->pool, other.get ());
}

TEST_F (Fuse, BuffersComeFromAnotherPoolWhereDownstreamsIsTooSmall)
{
  start ();
  Downstream downstream (fuse->get ());
  downstream.pool.reset (gst_video_buffer_pool_new ());
  downstream.min = 1;
  downstream.max = 4;
  push (0);
  EXPECT_NE (fuse->pull ()->pool, downstream.pool.get ());
}

TEST_F (Fuse, OffersVideoMetaAndAPoolToUpstream)
{
  start ();
  const CapsPtr caps = caps_of (gray_caps (kWidth, kHeight));
  const QueryPtr query (gst_query_new_allocation (caps.get (), TRUE));
  ASSERT_TRUE (gst_pad_peer_query (fuse->get ()->srcpad, query.get ()));
  EXPECT_TRUE (gst_query_find_allocation_meta (
      query.get (), GST_VIDEO_META_API_TYPE, nullptr));
  EXPECT_EQ (gst_query_get_n_allocation_pools (query.get ()), 1u);
}

TEST_F (Fuse, QosEndsHere)
{
  start ();
  push (0);
  gst_harness_push_upstream_event (
      fuse->get (), gst_event_new_qos (GST_QOS_TYPE_UNDERFLOW, 1.0, 5, 10));
  while (
      const EventPtr event{gst_harness_try_pull_upstream_event (fuse->get ())})
    EXPECT_NE (GST_EVENT_TYPE (event.get ()), GST_EVENT_QOS);
}

TEST_F (Fuse, CountersAgree)
{
  start ();
  push (0);
  push (1);
  EXPECT_EQ (counter_of (fuse->element (), "frames-in"), 2u);
  EXPECT_EQ (counter_of (fuse->element (), "frames-out"), 8u);
}

} // namespace

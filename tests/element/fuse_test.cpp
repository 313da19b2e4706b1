/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-fuse: pixels, times, schedules, losses, flushes. */
#include "downstream.h"
#include "harness.h"

#include "common/messages.h"
#include "common/meta.h"
#include "common/tag.h"
#include "fuse/fuser.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
constexpr int kWidth = 24, kHeight = 20;

/* Frame @number of a moving texture. */
template <typename Pixel = std::uint8_t>
Image<Pixel>
picture (int number)
{
  return draw<Pixel> (kWidth, kHeight, [number] (int x, int y) {
    const int value = (7 * (x + 3 * number) + 31 * y) % 251;
    return sizeof (Pixel) == 1 ? value : 257 * value;
  });
}

Schedule
schedule_of (const std::string &preset)
{
  auto schedule = Schedule::from_preset (preset);
  EXPECT_TRUE (schedule) << preset;
  return *schedule;
}

/* The frames that the library fuses from the pictures @numbers. */
template <typename Pixel = std::uint8_t>
std::vector<Image<Pixel>>
expected (const std::string &preset, std::initializer_list<int> numbers,
    const FuseOptions &options = {})
{
  auto fuser =
      Fuser<Pixel>::make (schedule_of (preset), kWidth, kHeight, options);
  EXPECT_TRUE (fuser) << fuser.error ().message;
  std::vector<Image<Pixel>> frames;
  const auto fuse_one = [&] {
    std::vector<Image<Pixel>> slots (std::size_t (fuser->slots ()),
        Image<Pixel> (fuser->size ().width, fuser->size ().height));
    std::vector<ImageView<Pixel>> views;
    for (auto &slot : slots)
      views.push_back (slot.view ());
    EXPECT_TRUE (fuser->fuse (views));
    frames.insert (frames.end (), slots.begin (), slots.end ());
  };
  for (const int number : numbers) {
    EXPECT_TRUE (fuser->take (picture<Pixel> (number).view ()));
    if (fuser->pending () > options.lookahead)
      fuse_one ();
  }
  while (fuser->pending () > 0)
    fuse_one ();
  return frames;
}

class Fuse : public ::testing::Test
{
protected:
  void start (const std::string &settings = "schedule=sequential:lattice:4/2",
      const std::string &rate = "25/1", const std::string &format = "GRAY8")
  {
    fuse = std::make_unique<ElementHarness> ("codedexposure-fuse " + settings);
    fuse->set_caps (gray_caps (kWidth, kHeight, rate, format));
  }
  void push (int number, GstClockTime pts, int flags = 0)
  {
    BufferPtr frame = frame_of (picture (number), pts);
    GST_BUFFER_FLAG_SET (frame.get (), flags);
    ASSERT_EQ (fuse->push (std::move (frame)), GST_FLOW_OK);
  }
  void push (int number) { push (number, GstClockTime (number) * kPeriod); }
  std::vector<BufferPtr> pull_all ()
  {
    std::vector<BufferPtr> all;
    while (BufferPtr buffer = fuse->pull ())
      all.push_back (std::move (buffer));
    return all;
  }
  template <typename Pixel = std::uint8_t>
  std::vector<Image<Pixel>> pull_images ()
  {
    std::vector<Image<Pixel>> images;
    const CapsPtr caps = fuse->pad_caps ();
    for (const BufferPtr &buffer : pull_all ())
      images.push_back (image_of<Pixel> (buffer.get (), caps.get ()));
    return images;
  }
  /* Indices of the frames with DISCONT. */
  std::vector<std::size_t> disconts ()
  {
    std::vector<std::size_t> places;
    const auto all = pull_all ();
    for (std::size_t i = 0; i < all.size (); i++)
      if (GST_BUFFER_IS_DISCONT (all[i].get ()))
        places.push_back (i);
    return places;
  }
  GstClockTime min_latency ()
  {
    gst_harness_set_upstream_latency (fuse->get (), 5 * GST_MSECOND);
    return gst_harness_query_latency (fuse->get ());
  }
  std::unique_ptr<ElementHarness> fuse;
};

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
  ASSERT_TRUE (fuse->push_event (gst_event_new_flush_start ()));
  ASSERT_TRUE (fuse->push_event (gst_event_new_flush_stop (TRUE)));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  ASSERT_TRUE (fuse->push_event (gst_event_new_segment (&segment)));
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
  ASSERT_TRUE (fuse->push_event (gst_event_new_flush_start ()));
  ASSERT_TRUE (fuse->push_event (gst_event_new_flush_stop (TRUE)));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  ASSERT_TRUE (fuse->push_event (gst_event_new_segment (&segment)));
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
  for (const bool flush : {false, true}) {
    start ();
    push (0);
    push (0, kPeriod);
    if (flush) {
      ASSERT_TRUE (fuse->push_event (gst_event_new_flush_start ()));
      ASSERT_TRUE (fuse->push_event (gst_event_new_flush_stop (TRUE)));
    }
    GstSegment segment;
    gst_segment_init (&segment, GST_FORMAT_TIME);
    segment.start = 10 * GST_SECOND;
    ASSERT_TRUE (fuse->push_event (gst_event_new_segment (&segment)));
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

TEST_F (Fuse, NeedsTimeStamps)
{
  start ();
  EXPECT_EQ (
      fuse->push (frame_of (picture (0), GST_CLOCK_TIME_NONE)), GST_FLOW_ERROR);
  EXPECT_NE (fuse->error ().find ("do-timestamp"), std::string::npos);
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

TEST_F (Fuse, CountersAgree)
{
  start ();
  push (0);
  push (1);
  EXPECT_EQ (counter_of (fuse->element (), "frames-in"), 2u);
  EXPECT_EQ (counter_of (fuse->element (), "frames-out"), 8u);
}

} // namespace

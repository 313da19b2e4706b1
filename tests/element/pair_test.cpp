/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-pair: what becomes a pair, and what is said of the rest. */
#include <future>
#include <random>

#include "pair_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;
using namespace codedexposure::test::pairs;
using namespace codedexposure::test::two_beams;

/* ------------------------------------------------------------------ time -- */

TEST_F (Pair, IsWhatWasExposedWithinAQuarterOfAPeriod)
{
  EXPECT_EQ (run (frames ({0, 1, 2}), frames ({0, 1, 2}, 10 * kMs)),
      (Numbers{{0, 0}, {1, 1}, {2, 2}}));
  expect_counters (3, 0, 0, 0);
  EXPECT_FALSE (pair.posted<PartnerLost> ());
}

TEST_F (Pair, IsNotWhatIsFartherAway)
{
  EXPECT_EQ (run (frames ({0, 1, 2}), frames ({0, 1, 2}, 10 * kMs + 1)),
      (Numbers{{0, kAlone}, {1, kAlone}, {2, kAlone}}));
  expect_counters (0, 3, 0, 3);
  expect_lost ("missing", 3, 0, 2 * kPeriod);
}

/* The exposure of a frame begins at its number of periods. */
void
say_starts (const std::vector<BufferPtr> &camera)
{
  for (const BufferPtr &frame : camera) {
    FrameMeta meta;
    meta.exposure_start = GST_BUFFER_OFFSET (frame.get ()) * kPeriod;
    set_frame_meta (frame.get (), meta);
  }
}

TEST_F (Pair, TheStartThatTheMetasSayCountsAndNotThePts)
{
  auto on = frames ({0, 1, 2}), partners = frames ({0, 1, 2}, 30 * kMs);
  for (auto *camera : {&on, &partners})
    say_starts (*camera);
  EXPECT_EQ (run (std::move (on), std::move (partners)),
      (Numbers{{0, 0}, {1, 1}, {2, 2}}));
}

/* A camera that counts from another start has another segment. */
TEST_F (Pair, RunningTimesAreCompared)
{
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.start = segment.time = 1000 * kMs;
  gst_harness_push_event (off.get (), gst_event_new_segment (&segment));
  EXPECT_EQ (run (frames ({0, 1, 2}), frames ({0, 1, 2}, 1000 * kMs)),
      (Numbers{{0, 0}, {1, 1}, {2, 2}}));
}

TEST_F (Pair, FramesAfterALostOneHavePartnersBackwardsAsWell)
{
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.rate = -1.0;
  segment.stop = 5 * kPeriod;
  for (GstHarness *camera : {pair.get (), off.get ()})
    gst_harness_push_event (camera, gst_event_new_segment (&segment));
  auto on = frames ({4, 3, 1, 0}), partners = frames ({4, 3, 2, 1, 0});
  for (auto *camera : {&on, &partners})
    say_starts (*camera);
  EXPECT_EQ (run (std::move (on), std::move (partners)),
      (Numbers{{4, 4}, {3, 3}, {1, 1}, {0, 0}}));
  expect_counters (4, 0, 0, 1);
}

/* ---------------------------------------------------------------- losses -- */

TEST_F (Pair, AFrameWhosePartnerIsLostGoesOnAsItCame)
{
  const auto sent = frames ({0, 1, 2, 3});
  auto on = frames ({0, 1, 2, 3});
  GST_BUFFER_FLAG_SET (on[1].get (), GST_BUFFER_FLAG_MARKER);
  EXPECT_EQ (run (std::move (on), frames ({0, 3})),
      (Numbers{{0, 0}, {1, kAlone}, {2, kAlone}, {3, 3}}));
  expect_counters (2, 2, 0, 0);
  expect_lost ("missing", 2, kPeriod, 3 * kPeriod);
  const CapsPtr caps = pair.pad_caps ();
  for (std::size_t i = 0; i < out.size (); i++) {
    EXPECT_EQ (image_of<std::uint8_t> (out[i].get (), caps.get ()),
        image_of<std::uint8_t> (sent[i].get (), caps.get ()));
    EXPECT_EQ (GST_BUFFER_PTS (out[i].get ()), i * kPeriod);
    EXPECT_EQ (GST_BUFFER_DURATION (out[i].get ()), kPeriod);
  }
  EXPECT_TRUE (GST_BUFFER_FLAG_IS_SET (out[1].get (), GST_BUFFER_FLAG_MARKER));
}

TEST_F (Pair, AFrameOfTheSecondCameraAloneIsDropped)
{
  EXPECT_EQ (
      run (frames ({0, 3}), frames ({0, 1, 2, 3})), (Numbers{{0, 0}, {3, 3}}));
  expect_counters (2, 0, 0, 2);
}

TEST_F (Pair, TheEndOfTheSecondCameraIsNotTheEnd)
{
  EXPECT_EQ (run (frames ({0, 1, 2}), frames ({0})),
      (Numbers{{0, 0}, {1, kAlone}, {2, kAlone}}));
  expect_lost ("missing", 2, kPeriod, 2 * kPeriod);
}

TEST_F (Pair, TheEndOfTheFirstCameraIs)
{
  EXPECT_EQ (run (frames ({0}), frames ({0, 1, 2})), (Numbers{{0, 0}}));
}

TEST_F (Pair, WhatIsDamagedIsNoPartnerAndGetsNone)
{
  auto on = frames ({0, 1, 2, 3}), partners = frames ({0, 1, 2, 3});
  GST_BUFFER_FLAG_SET (on[0].get (), GST_BUFFER_FLAG_CORRUPTED);
  GST_BUFFER_FLAG_SET (partners[1].get (), GST_BUFFER_FLAG_GAP);
  EXPECT_EQ (run (std::move (on), std::move (partners)),
      (Numbers{{0, kAlone}, {1, kAlone}, {2, 2}, {3, 3}}));
  expect_lost ("damaged", 2, 0, 2 * kPeriod);
}

/* A calibration needs both cameras. */
TEST_F (Pair, FramesOfAPatternHavePartners)
{
  auto on = frames ({0, 1, 2});
  FrameMeta meta;
  meta.pattern = "dmdsync:white";
  meta.frame = 1;
  set_frame_meta (on[1].get (), meta);
  EXPECT_EQ (run (std::move (on), frames ({0, 1, 2})),
      (Numbers{{0, 0}, {1, 1}, {2, 2}}));
}

/* ---------------------------------------------------------------- pixels -- */

class TwoBeams : public Pair
{
protected:
  static constexpr std::size_t kFrames = 75;
  static constexpr Extent kSize{160, 120};

  TwoBeams ()
  {
    const Schedule schedule = schedule_of (kPreset);
    const Pictures slots =
        moving_clouds (kSize, int (kFrames) * schedule.slots (), 0.7);
    on_ = coded (schedule, slots);
    off_ = coded (*schedule.complement (), slots);
    for (GstHarness *camera : {pair.get (), off.get ()})
      gst_harness_set_src_caps_str (
          camera, gray_caps (kSize.width, kSize.height).c_str ());
    push_setup (pair.get (), {.schedule = schedule});
    push_setup (off.get (), {.schedule = schedule, .off_beam = true});
  }
  BufferPtr first (guint64 number, GstClockTime pts) const
  {
    return numbered (number, pts, on_[number]);
  }
  BufferPtr second (guint64 number, GstClockTime pts) const
  {
    return numbered (number, pts, off_[number]);
  }

  Pictures on_, off_;
};

/* Times that are wrong by @step frames. */
class OutOfStep : public TwoBeams, public ::testing::WithParamInterface<int>
{
};

TEST_P (OutOfStep, IsSeenInThePixelsAndSaid)
{
  const guint64 first_on = GetParam () < 0 ? 1 : 0;
  const guint64 first_off = GetParam () > 0 ? 1 : 0;
  std::vector<BufferPtr> on, partners;
  for (guint64 i = 0; i < 20; i++) {
    on.push_back (first (i + first_on, i * kPeriod));
    partners.push_back (second (i + first_off, i * kPeriod));
  }
  const Numbers all = run (std::move (on), std::move (partners));
  ASSERT_EQ (all.size (), 20u);
  for (std::size_t i = 1; i < all.size (); i++)
    EXPECT_EQ (all[i].second, kAlone) << "frame " << i;
  EXPECT_EQ (counter ("pairs-refused"), 19u);
  expect_lost ("other-exposure", 19, kPeriod, 19 * kPeriod);
  EXPECT_EQ (pair.warning (),
      "The frames of the second camera are of other exposures than the coded "
      "frames whose times they have, as their pixels show; coded frames go on "
      "alone. Trigger both cameras by one signal, and start both before it.");
  EXPECT_EQ (pair.warning (), "") << "once";
}

INSTANTIATE_TEST_SUITE_P (Steps, OutOfStep, ::testing::Values (-1, 1));

/* What happens to the frames of both cameras. */
struct Trouble {
  const char *name;
  double lost_on, lost_off; ///< parts
  GstClockTime jitter;
  bool pause_off, pause_on; ///< for a second
};

class PairTrouble : public TwoBeams,
                    public ::testing::WithParamInterface<Trouble>
{
protected:
  std::vector<BufferPtr> camera (bool is_on, double lost, bool pauses)
  {
    std::vector<BufferPtr> all;
    std::uniform_real_distribution<double> part (0.0, 1.0);
    for (guint64 i = 0; i < kFrames; i++) {
      const bool pause = pauses && i >= 30 && i < 55;
      if (part (random_) < lost || pause)
        continue;
      const auto late =
          GstClockTime (part (random_) * double (GetParam ().jitter));
      all.push_back (is_on ? first (i, i * kPeriod + late)
                           : second (i, i * kPeriod + late));
    }
    return all;
  }

  std::mt19937 random_{5};
};

TEST_P (PairTrouble, MakesNoWrongPairAndLosesNothingUntold)
{
  auto on = camera (true, GetParam ().lost_on, GetParam ().pause_on);
  auto partners = camera (false, GetParam ().lost_off, GetParam ().pause_off);
  std::vector<guint64> sent, sent_off;
  for (const BufferPtr &frame : on)
    sent.push_back (GST_BUFFER_OFFSET (frame.get ()));
  for (const BufferPtr &frame : partners)
    sent_off.push_back (GST_BUFFER_OFFSET (frame.get ()));
  Numbers expected;
  guint64 paired = 0;
  for (const guint64 number : sent) {
    const bool both = std::ranges::binary_search (sent_off, number);
    expected.emplace_back (number, both ? number : kAlone);
    paired += both;
  }
  EXPECT_EQ (run (std::move (on), std::move (partners)), expected);
  EXPECT_EQ (counter ("frames-paired"), paired);
  EXPECT_EQ (counter ("frames-alone"), sent.size () - paired);
  EXPECT_EQ (counter ("pairs-refused"), 0u);
  /* The first has nothing to be compared with, but frames that are alone. */
  const bool nothing = sent.front () == sent_off.front ();
  EXPECT_EQ (counter ("pairs-confirmed"), paired - nothing);
  guint64 said = 0;
  while (const auto lost = pair.posted<PartnerLost> ())
    said += lost->frames.value_or (0);
  EXPECT_EQ (said, sent.size () - paired);
  EXPECT_EQ (pair.warning (), "");
}

INSTANTIATE_TEST_SUITE_P (Campaign, PairTrouble,
    ::testing::Values (Trouble{"none", 0, 0, 0, false, false},
        Trouble{"lost_on", 0.1, 0, 0, false, false},
        Trouble{"lost_off", 0, 0.1, 0, false, false},
        Trouble{"both", 0.1, 0.1, 9 * kMs, false, false},
        Trouble{"jitter", 0, 0, 9 * kMs, false, false},
        Trouble{"off_stops", 0.01, 0.01, 9 * kMs, true, false},
        Trouble{"on_stops", 0.01, 0.01, 9 * kMs, false, true}),
    [] (const auto &trouble) { return std::string (trouble.param.name); });

/* ------------------------------------------------------------ flush, live --
 */

TEST_F (Pair, PairsAgainAfterAFlush)
{
  for (GstHarness *camera : {pair.get (), off.get ()})
    gst_harness_push (camera, numbered (0, 0).release ());
  BufferPtr before (gst_harness_pull (pair.get ()));
  ASSERT_TRUE (before);
  for (GstHarness *camera : {pair.get (), off.get ()})
    gst_harness_push_event (camera, gst_event_new_flush_start ());
  for (GstHarness *camera : {pair.get (), off.get ()})
    gst_harness_push_event (camera, gst_event_new_flush_stop (TRUE));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  for (GstHarness *camera : {pair.get (), off.get ()})
    gst_harness_push_event (camera, gst_event_new_segment (&segment));
  EXPECT_EQ (run (frames ({5, 6}), frames ({5, 6})), (Numbers{{5, 5}, {6, 6}}));
}

TEST (PairLive, AFrameWaitsForItsPartnerAndThenGoesAlone)
{
  ElementHarness pair ("codedexposure-pair", "on", "src");
  const HarnessPtr off (
      gst_harness_new_with_element (pair.element (), "off", nullptr));
  gst_harness_use_testclock (pair.get ());
  for (GstHarness *camera : {pair.get (), off.get ()}) {
    gst_harness_set_upstream_latency (camera, 5 * kMs);
    gst_harness_set_src_caps_str (camera, gray_caps (kWidth, kHeight).c_str ());
  }
  pair.push (numbered (0, 0));
  gst_harness_push (off.get (), numbered (0, 0).release ());
  BufferPtr next (gst_harness_pull (pair.get ()));
  ASSERT_TRUE (next);
  EXPECT_TRUE (get_partner (next.get ()));
  EXPECT_EQ (gst_harness_query_latency (pair.get ()), 15 * kMs);

  pair.push (numbered (1, kPeriod));
  /* The clock reaches the time for which the element waits. */
  ASSERT_TRUE (gst_harness_crank_single_clock_wait (pair.get ()));
  next.reset (gst_harness_pull (pair.get ()));
  ASSERT_TRUE (next);
  EXPECT_FALSE (get_partner (next.get ()));
  const ObjectPtr<GstTestClock> clock (gst_harness_get_testclock (pair.get ()));
  EXPECT_EQ (gst_clock_get_time (GST_CLOCK (clock.get ())), kPeriod + 15 * kMs);

  /* The first camera is silent. */
  std::promise<void> dropped[5];
  for (guint64 k = 2; k < 5; k++) {
    BufferPtr frame = numbered (k, k * kPeriod);
    gst_mini_object_weak_ref (
        GST_MINI_OBJECT (frame.get ()),
        [] (gpointer of_frame, GstMiniObject *) {
          static_cast<std::promise<void> *> (of_frame)->set_value ();
        },
        &dropped[k]);
    gst_harness_push (off.get (), frame.release ());
    ASSERT_TRUE (gst_harness_crank_single_clock_wait (pair.get ()));
    EXPECT_EQ (gst_clock_get_time (GST_CLOCK (clock.get ())),
        k * kPeriod + 15 * kMs + GST_SECOND);
    /* A frame that came before would begin the wait anew. */
    dropped[k].get_future ().wait ();
  }
  pair.push (numbered (30, 30 * kPeriod));
  gst_harness_push (off.get (), numbered (30, 30 * kPeriod).release ());
  next.reset (gst_harness_pull (pair.get ()));
  ASSERT_TRUE (next);
  EXPECT_TRUE (get_partner (next.get ()));
  EXPECT_EQ (property<guint64> (pair.element (), "partners-dropped"), 3u);
}

} // namespace

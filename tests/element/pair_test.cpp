/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-pair: what becomes a pair, and what is said of the rest. */
#include <random>
#include <thread>

#include "common/messages.h"
#include "common/meta.h"
#include "common/partner.h"
#include "common/tag.h"
#include "harness.h"
#include "two_beams.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;
using namespace codedexposure::test::two_beams;

constexpr GstClockTime kMs = GST_MSECOND;
constexpr GstClockTime kPeriod = 40 * kMs;

/* A frame that is known again by its number. */
BufferPtr
numbered (guint64 number, GstClockTime pts, Image<std::uint8_t> picture = {})
{
  if (picture.width () == 0)
    picture = draw<std::uint8_t> (
        kWidth, kHeight, [&] (int x, int y) { return int (number) + x + y; });
  BufferPtr frame = frame_of (picture, pts);
  GST_BUFFER_OFFSET (frame.get ()) = number;
  GST_BUFFER_DURATION (frame.get ()) = kPeriod;
  return frame;
}

/* The frames @numbers, at their times and @late. */
std::vector<BufferPtr>
frames (const std::vector<guint64> &numbers, GstClockTime late = 0)
{
  std::vector<BufferPtr> all;
  for (const guint64 number : numbers)
    all.push_back (numbered (number, number * kPeriod + late));
  return all;
}

constexpr guint64 kAlone = G_MAXUINT64;
using Numbers = std::vector<std::pair<guint64, guint64>>; ///< with partner

class Pair : public ::testing::Test
{
protected:
  Pair ()
      : pair ("codedexposure-pair", "on", "src"),
        off (gst_harness_new_with_element (pair.element (), "off", nullptr))
  {
    gst_harness_set_live (pair.get (), FALSE);
    gst_harness_set_live (off.get (), FALSE);
    pair.set_caps (gray_caps (kWidth, kHeight));
    gst_harness_set_src_caps_str (
        off.get (), gray_caps (kWidth, kHeight).c_str ());
  }

  /* All frames of both cameras, each from a thread of its own, to the end. */
  Numbers run (std::vector<BufferPtr> on, std::vector<BufferPtr> partners)
  {
    const auto push = [] (GstHarness *to, std::vector<BufferPtr> all) {
      for (BufferPtr &frame : all)
        gst_harness_push (to, frame.release ());
      gst_harness_push_event (to, gst_event_new_eos ());
    };
    std::jthread second (push, off.get (), std::move (partners));
    std::jthread first (push, pair.get (), std::move (on));
    Numbers numbers;
    GstBuffer *next = nullptr;
    /* With an error, the end does not come. */
    while (gst_harness_pull_until_eos (pair.get (), &next) && next) {
      out.emplace_back (next);
      const auto partner = get_partner (next);
      numbers.emplace_back (GST_BUFFER_OFFSET (next),
          partner ? GST_BUFFER_OFFSET (partner->buffer.get ()) : kAlone);
    }
    return numbers;
  }
  guint64 counter (const char *name)
  {
    return property<guint64> (pair.element (), name);
  }
  void expect_counters (
      guint64 paired, guint64 alone, guint64 refused, guint64 dropped)
  {
    EXPECT_EQ (counter ("frames-paired"), paired);
    EXPECT_EQ (counter ("frames-alone"), alone);
    EXPECT_EQ (counter ("pairs-refused"), refused);
    EXPECT_EQ (counter ("partners-dropped"), dropped);
  }
  void expect_lost (
      const char *reason, guint64 count, GstClockTime from, GstClockTime to)
  {
    const auto begun = pair.posted<PartnerLost> ();
    const auto ended = pair.posted<PartnerLost> ();
    ASSERT_TRUE (begun && ended);
    EXPECT_TRUE (begun->active);
    EXPECT_EQ (begun->reason, reason);
    EXPECT_EQ (begun->from, from);
    EXPECT_FALSE (ended->active);
    EXPECT_EQ (ended->reason, reason);
    EXPECT_EQ (ended->frames, count);
    EXPECT_EQ (ended->from, from);
    EXPECT_EQ (ended->to, to);
  }
  void push_setup (GstHarness *to, const StreamSetup &setup)
  {
    ASSERT_TRUE (gst_harness_push_event (to, setup_to_event (setup)));
  }
  /* The stream tag, with a second camera of 40x30 pixels of that setup. */
  std::optional<StreamSetup> tag_with (StreamSetup second)
  {
    second.off_beam = true;
    push_setup (off.get (), second);
    push_setup (pair.get (), {.schedule = second.schedule});
    gst_harness_set_src_caps_str (off.get (), gray_caps (40, 30).c_str ());
    run (frames ({0}), {});
    std::optional<StreamSetup> tagged;
    while (const EventPtr event = pair.pull_event (GST_EVENT_TAG))
      if (const auto setup = setup_from_tags (tags_of (event.get ())))
        tagged = setup->value ();
    return tagged;
  }

  ElementHarness pair;
  HarnessPtr off;
  std::vector<BufferPtr> out;
};

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
  expect_counters (0, 3, 0, 2);
  expect_lost ("missing", 3, 0, 2 * kPeriod);
}

TEST_F (Pair, TheStartThatTheMetasSayCountsAndNotThePts)
{
  auto on = frames ({0, 1, 2}), partners = frames ({0, 1, 2}, 30 * kMs);
  for (auto *camera : {&on, &partners})
    for (const BufferPtr &frame : *camera) {
      FrameMeta meta;
      meta.exposure_start = GST_BUFFER_OFFSET (frame.get ()) * kPeriod;
      set_frame_meta (frame.get (), meta);
    }
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

TEST_F (Pair, GapsOfTheFirstCameraStayBetweenItsFrames)
{
  gst_harness_push (off.get (), numbered (0, 0).release ());
  gst_harness_push (pair.get (), numbered (0, 0).release ());
  const BufferPtr first (gst_harness_pull (pair.get ()));
  for (GstHarness *camera : {off.get (), pair.get ()})
    gst_harness_push_event (camera, gst_event_new_gap (kPeriod, kPeriod));
  EXPECT_EQ (run (frames ({2}), frames ({2})), (Numbers{{2, 2}}));
  const EventPtr gap = pair.pull_event (GST_EVENT_GAP);
  ASSERT_TRUE (gap);
  GstClockTime pts = 0, duration = 0;
  gst_event_parse_gap (gap.get (), &pts, &duration);
  EXPECT_EQ (pts, kPeriod);
  EXPECT_EQ (duration, kPeriod);
  EXPECT_FALSE (pair.pull_event (GST_EVENT_GAP));
}

/* --------------------------------------------------------------- streams -- */

TEST_F (Pair, TheTagSaysHowTheSecondCameraStands)
{
  const Schedule schedule = schedule_of (kPreset);
  const Mapping mapping (Extent{40, 30});
  BenchProfile bench;
  bench.camera.size = {40, 30};
  bench.black_level = Measured{5.2, 0.1};
  bench.conversion_gain = Measured{20.5, 0.1};
  bench.read_noise = Measured{6.5, 0.1};
  bench.light_ratio = Measured{0.75, 0.01};
  const auto tagged =
      tag_with ({.schedule = schedule, .mapping = mapping, .bench = bench});
  EXPECT_EQ (tagged,
      (StreamSetup{.schedule = schedule,
          .partner = PartnerSetup{{40, 30}, mapping, 5, 20.5, 6.5, 0.75}}));
}

/* As behind dmdsync, which tags the profile. */
TEST_F (Pair, TheMappingOfTheSecondCamerasProfileCounts)
{
  BenchProfile bench;
  bench.camera.size = {40, 30};
  bench.mapping = Mapping (Extent{40, 30});
  const auto tagged =
      tag_with ({.schedule = schedule_of (kPreset), .bench = bench});
  ASSERT_TRUE (tagged && tagged->partner);
  EXPECT_EQ (tagged->partner->mapping, bench.mapping);
}

TEST_F (Pair, OtherTagsOfTheFirstCameraGoThroughAndThoseOfTheSecondDoNot)
{
  const auto titled = [] (const char *title) {
    return gst_event_new_tag (gst_tag_list_new (GST_TAG_TITLE, title, nullptr));
  };
  gst_harness_push_event (pair.get (), titled ("first"));
  gst_harness_push_event (off.get (), titled ("second"));
  run (frames ({0}), frames ({0}));
  const EventPtr event = pair.pull_event (GST_EVENT_TAG);
  ASSERT_TRUE (event);
  gchar *title = nullptr;
  gst_tag_list_get_string (tags_of (event.get ()), GST_TAG_TITLE, &title);
  EXPECT_STREQ (title, "first");
  g_free (title);
  EXPECT_FALSE (pair.pull_event (GST_EVENT_TAG));
}

TEST_F (Pair, SwappedCamerasAreAnErrorThatSaysSo)
{
  push_setup (
      pair.get (), {.schedule = schedule_of (kPreset), .off_beam = true});
  EXPECT_EQ (run (frames ({0, 1}), frames ({0, 1})), Numbers{});
  EXPECT_EQ (pair.error (),
      "The frames of pad on are of the beam of the mirrors that are off. Link "
      "them to pad off.");
}

TEST_F (Pair, AFirstCameraAtPadOffIsAnErrorToo)
{
  push_setup (off.get (), {.schedule = schedule_of (kPreset)});
  EXPECT_EQ (run (frames ({0, 1}), frames ({0, 1})), Numbers{});
  EXPECT_EQ (pair.error (),
      "The frames of pad off are of the beam of the mirrors that are on. Link "
      "them to pad on.");
}

TEST_F (Pair, CapsAndAllocationAreThoseOfTheFirstCamera)
{
  gst_harness_set_src_caps_str (
      off.get (), gray_caps (32, 20, "50/1", "GRAY16_LE").c_str ());
  run (frames ({0, 1}), {});
  EXPECT_TRUE (
      same_caps (pair.pad_caps ().get (), gray_caps (kWidth, kHeight)));
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
}

} // namespace

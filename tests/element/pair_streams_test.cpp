/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-pair: caps, tags, gaps and ends of both cameras. */
#include <algorithm>
#include <string>
#include <vector>

#include "pair_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;
using namespace codedexposure::test::pairs;

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
      "The frames of the first camera (pad on) are of the beam of the mirrors "
      "that are off. Link "
      "them to pad off, or use \"codedexposure decode FIRST.mkv --fuse "
      "QUALITY --second SECOND.mkv\", whose SECOND.mkv has the beam of the "
      "mirrors that are off.");
}

TEST_F (Pair, AFirstCameraAtPadOffIsAnErrorToo)
{
  push_setup (off.get (), {.schedule = schedule_of (kPreset)});
  EXPECT_EQ (run (frames ({0, 1}), frames ({0, 1})), Numbers{});
  EXPECT_EQ (pair.error (),
      "The frames of the second camera (pad off) are of the beam of the "
      "mirrors that are on. Link "
      "them to pad on, or use \"codedexposure decode FIRST.mkv --fuse "
      "QUALITY --second SECOND.mkv\", whose SECOND.mkv has the beam of the "
      "mirrors that are off.");
}

TEST_F (Pair, CapsAndAllocationAreThoseOfTheFirstCamera)
{
  gst_harness_set_src_caps_str (
      off.get (), gray_caps (32, 20, "50/1", "GRAY16_LE").c_str ());
  run (frames ({0, 1}), {});
  EXPECT_TRUE (
      same_caps (pair.pad_caps ().get (), gray_caps (kWidth, kHeight)));
}

/* ------------------------------------------------------------------ caps -- */

/* Frames whose caps change while they wait for those of the other camera. */
class PairSizes : public Pair
{
protected:
  static constexpr Extent kLarge{2 * kWidth, 2 * kHeight};

  PairSizes ()
  {
    gst_pad_add_probe (
        pair.get ()->sinkpad, GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *pad, GstPadProbeInfo *info, gpointer data) {
          const CapsPtr caps (gst_pad_get_current_caps (pad));
          static_cast<PairSizes *> (data)->compare (
              GST_PAD_PROBE_INFO_BUFFER (info), caps.get ());
          return GST_PAD_PROBE_OK;
        },
        this, nullptr);
  }
  static BufferPtr large (guint64 number)
  {
    return numbered (number, number * kPeriod,
        Image<std::uint8_t> (kLarge.width, kLarge.height));
  }
  void grow (GstHarness *camera)
  {
    gst_harness_set_src_caps_str (
        camera, gray_caps (kLarge.width, kLarge.height).c_str ());
  }
  void compare (GstBuffer *frame, GstCaps *caps)
  {
    const auto size_of = [] (GstCaps *of) { return info_of (of).size; };
    EXPECT_EQ (gst_buffer_get_size (frame), size_of (caps));
    const auto partner = get_partner (frame);
    if (partner) {
      EXPECT_EQ (gst_buffer_get_size (partner->buffer.get ()),
          size_of (partner->caps.get ()));
    }
  }
};

TEST_F (PairSizes, TheCapsOfAPartnerAreItsOwnIfItsCameraIsAhead)
{
  gst_harness_push (off.get (), numbered (0, 0).release ());
  grow (off.get ());
  std::vector<BufferPtr> partners;
  partners.push_back (large (1));
  EXPECT_EQ (
      run (frames ({0, 1}), std::move (partners)), (Numbers{{0, 0}, {1, 1}}));
}

TEST_F (PairSizes, TheCapsOfACodedFrameAreItsOwnIfItsCameraIsAhead)
{
  pair.push (numbered (0, 0));
  grow (pair.get ());
  std::vector<BufferPtr> on;
  on.push_back (large (1));
  EXPECT_EQ (run (std::move (on), frames ({0, 1})), (Numbers{{0, 0}, {1, 1}}));
}

/* Fusion and sums read the pixels of both by one format. */
TEST_F (Pair, CamerasOfDifferentFormatsAreAnErrorThatNamesBoth)
{
  gst_harness_set_src_caps_str (off.get (),
      gray_caps (kWidth / 2, kHeight, "25/1", "GRAY16_LE").c_str ());
  EXPECT_EQ (run (frames ({0, 1}), frames ({0, 1})), Numbers{});
  EXPECT_EQ (pair.error (),
      "The frames of the first camera are GRAY8, and those of the second are "
      "GRAY16_LE. Set both cameras to the same pixel format.");
}

TEST_F (Pair, CamerasOfDifferentBitsAreAnErrorThatNamesBoth)
{
  for (GstHarness *camera : {pair.get (), off.get ()}) {
    gst_harness_set_src_caps_str (
        camera, gray_caps (kWidth / 2, kHeight, "25/1", "GRAY16_LE").c_str ());
    const bool is_first = camera == pair.get ();
    push_setup (camera, {.schedule = schedule_of (kPreset),
                            .bits = is_first ? 10 : 12,
                            .off_beam = !is_first});
  }
  EXPECT_EQ (run (frames ({0, 1}), frames ({0, 1})), Numbers{});
  EXPECT_EQ (pair.error (),
      "The frames of the first camera are GRAY16_LE with 10 bits, and those of "
      "the second are GRAY16_LE with 12 bits. Set both cameras to the same "
      "pixel format.");
}

/* As codedexposure-camerasrc says them, which tags nothing. */
TEST_F (Pair, SoAreThoseWhoseFramesSayTheirBits)
{
  for (GstHarness *camera : {pair.get (), off.get ()})
    gst_harness_set_src_caps_str (
        camera, gray_caps (kWidth / 2, kHeight, "25/1", "GRAY16_LE").c_str ());
  auto on = frames ({0, 1}), partners = frames ({0, 1});
  for (const BufferPtr &frame : on)
    set_frame_meta (frame.get (), {.bits = 12});
  for (const BufferPtr &frame : partners)
    set_frame_meta (frame.get (), {.bits = 10});
  EXPECT_EQ (run (std::move (on), std::move (partners)), Numbers{});
  EXPECT_EQ (pair.error (),
      "The frames of the first camera are GRAY16_LE with 12 bits, and those of "
      "the second are GRAY16_LE with 10 bits. Set both cameras to the same "
      "pixel format.");
}

/* Fusion takes what the second camera saw for the complement of the masks of
 * the first. */
TEST_F (Pair, CamerasOfDifferentSchedulesMakeNoPairs)
{
  push_setup (pair.get (), {.schedule = schedule_of (kPreset)});
  push_setup (off.get (),
      {.schedule = schedule_of ("sequential:lattice:8/3"), .off_beam = true});
  EXPECT_EQ (run (frames ({0, 1}), frames ({0, 1})),
      (Numbers{{0, kAlone}, {1, kAlone}}));
  EXPECT_EQ (pair.warning (),
      "The frames of the first camera have the schedule " +
          std::string (kPreset) +
          ", and those of the second sequential:lattice:8/3; coded frames go "
          "on alone. Both cameras see the same masks: give both the same "
          "schedule.");
}

/* Of the masks, not of what each profile and camera says. */
TEST_F (Pair, TimesAndLeakOfTheirSchedulesMayDiffer)
{
  push_setup (pair.get (), {.schedule = schedule_of (kPreset)});
  push_setup (
      off.get (), {.schedule = schedule_of (
                       std::string (kPreset) + ",leak=0.01,switching=0.2ms"),
                      .off_beam = true});
  EXPECT_EQ (run (frames ({0, 1}), frames ({0, 1})), (Numbers{{0, 0}, {1, 1}}));
}

TEST_F (Pair, TheSizesOfBothCamerasMayDiffer)
{
  gst_harness_set_src_caps_str (
      off.get (), gray_caps (kWidth / 2, 2 * kHeight).c_str ());
  EXPECT_EQ (run (frames ({0, 1}), frames ({0, 1})), (Numbers{{0, 0}, {1, 1}}));
}

/* ------------------------------------------------------------ gaps, end -- */

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

/* Sinks wait for it where the frames of a stream pause. */
TEST_F (Pair, AGapOfTheFirstCameraDoesNotWaitForItsNextFrame)
{
  for (GstHarness *camera : {off.get (), pair.get ()})
    gst_harness_push (camera, numbered (0, 0).release ());
  const BufferPtr first (gst_harness_pull (pair.get ()));
  pair.push_event (gst_event_new_gap (kPeriod, kPeriod));
  bool has_come = false;
  while (const EventPtr event{gst_harness_pull_event (pair.get ())}) {
    has_come = GST_EVENT_TYPE (event.get ()) == GST_EVENT_GAP;
    if (has_come)
      break;
  }
  EXPECT_TRUE (has_come);
}

TEST_F (Pair, WhatComesBeforeAnEndWithoutFramesComesOutInItsOrder)
{
  push_setup (pair.get (), {.schedule = schedule_of (kPreset)});
  pair.push_event (gst_event_new_gap (kPeriod, kPeriod));
  EXPECT_EQ (run ({}, {}), Numbers{});
  std::vector<GstEventType> types;
  while (const EventPtr event{gst_harness_try_pull_event (pair.get ())})
    if (GST_EVENT_TYPE (event.get ()) != GST_EVENT_EOS)
      types.push_back (GST_EVENT_TYPE (event.get ()));
  EXPECT_EQ (types, (std::vector{GST_EVENT_STREAM_START, GST_EVENT_CAPS,
                        GST_EVENT_SEGMENT, GST_EVENT_TAG, GST_EVENT_GAP}));
}

TEST_F (Pair, FramesOfTheSecondCameraThatAreLeftAtTheEndCountAsDropped)
{
  for (GstHarness *camera : {off.get (), pair.get ()})
    gst_harness_push (camera, numbered (0, 0).release ());
  const BufferPtr first (gst_harness_pull (pair.get ()));
  gst_harness_push (off.get (), numbered (1, kPeriod).release ());
  EXPECT_EQ (run ({}, {}), Numbers{});
  expect_counters (1, 0, 0, 1);
}

TEST_F (Pair, CountersCanBeReadUntilTheNextRunStarts)
{
  run (frames ({0, 1, 2}), frames ({0, 2}));
  ASSERT_EQ (gst_element_set_state (pair.element (), GST_STATE_READY),
      GST_STATE_CHANGE_SUCCESS);
  expect_counters (2, 1, 0, 0);
  gst_element_set_state (pair.element (), GST_STATE_PAUSED);
  expect_counters (0, 0, 0, 0);
}

} // namespace

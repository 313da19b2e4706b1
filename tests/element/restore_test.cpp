/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The parts log and restore: what was written beside frames is on them again,
 * and what is not as it was recorded is CORRUPTED. */
#include "restored.h"

#include <memory>
#include <string>
#include <vector>

#include "common/messages.h"
#include "record/track.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

TEST_F (Restore, EverythingThatWasKnownIsKnownAgain)
{
  play ();
  ASSERT_EQ (restored.size (), std::size_t (kFrames));
  for (int i = 0; i < kFrames; i++) {
    const auto meta = get_frame_meta (restored[std::size_t (i)].get ());
    const FrameMeta told = meta_of (i);
    ASSERT_TRUE (meta) << i;
    EXPECT_EQ (meta->frame, told.frame);
    EXPECT_EQ (meta->exposure_start, told.exposure_start);
    EXPECT_EQ (meta->exposure_duration, told.exposure_duration);
    EXPECT_EQ (meta->locked, told.locked);
    EXPECT_EQ (meta->slip, told.slip);
    EXPECT_EQ (meta->bits, told.bits);
    EXPECT_EQ (corrupted (i), i == 2) << i;
    EXPECT_EQ (GST_BUFFER_PTS (restored[std::size_t (i)].get ()),
        GstClockTime (i) * kPeriod);
  }
  EXPECT_EQ (schedule (), "staircase:2x2");
  EXPECT_FALSE (file.posted<FramesDamaged> ());
  EXPECT_FALSE (file.posted<StreamCut> ());
  EXPECT_FALSE (file.posted<StreamIncomplete> ());
}

TEST_F (Restore, OtherPixelsAreCorruptedAndCounted)
{
  for (const int i : {3, 4})
    gst_buffer_memset (recording.frames[std::size_t (i)].get (), 63, 200, 1);
  play ();
  for (int i = 0; i < kFrames; i++)
    EXPECT_EQ (corrupted (i), i == 2 || i == 3 || i == 4) << i;
  EXPECT_EQ (counted (file.element (), "frames-damaged"), 2u);
  const auto begin = file.posted<FramesDamaged> ();
  ASSERT_TRUE (begin);
  EXPECT_TRUE (begin->active);
  EXPECT_EQ (begin->frame, 13u);
  EXPECT_EQ (begin->from, 3 * kPeriod);
  const auto over = file.posted<FramesDamaged> ();
  ASSERT_TRUE (over);
  EXPECT_FALSE (over->active);
  EXPECT_EQ (over->count, 2u);
}

TEST_F (Restore, AFrameWithoutItsLineIsCorrupted)
{
  play (-1, 3);
  ASSERT_EQ (restored.size (), std::size_t (kFrames));
  for (int i = 0; i < kFrames; i++)
    EXPECT_EQ (corrupted (i), i == 2 || i == 3) << i;
  const auto meta = get_frame_meta (restored[3].get ());
  ASSERT_TRUE (meta);
  EXPECT_EQ (meta->frame, 13u);
  EXPECT_FALSE (meta->locked);
  EXPECT_EQ (counted (file.element (), "frames-unknown"), 1u);
  ASSERT_TRUE (file.posted<FramesDamaged> ());
}

TEST_F (Restore, AFirstFrameWithoutItsLineIsNumberedByTheNextOne)
{
  play (-1, 0);
  EXPECT_EQ (get_frame_meta (restored.at (0).get ())->frame, 10u);
  EXPECT_EQ (file.posted<FramesDamaged> ()->frame, 10u);
}

TEST_F (Restore, AfterASeekTheNumberOfAFrameWithoutALineIsNotSaid)
{
  file.push_event (gst_event_new_flush_start ());
  file.push_event (gst_event_new_flush_stop (TRUE));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  file.push_event (gst_event_new_segment (&segment));
  push_frame (5);
  end ();
  const auto begin = file.posted<FramesDamaged> ();
  ASSERT_TRUE (begin);
  EXPECT_FALSE (begin->frame);
}

TEST_F (Restore, AFrameWithoutATimeIsCorruptedAndKeepsItsPlace)
{
  GST_BUFFER_PTS (recording.frames[1].get ()) = GST_CLOCK_TIME_NONE;
  play ();
  ASSERT_EQ (restored.size (), std::size_t (kFrames));
  EXPECT_FALSE (corrupted (0));
  EXPECT_TRUE (corrupted (1));
  EXPECT_FALSE (GST_BUFFER_PTS_IS_VALID (restored[1].get ()));
  EXPECT_FALSE (corrupted (4));
}

TEST_F (Restore, ADamagedLineIsCountedAndItsFrameCorrupted)
{
  gst_buffer_memset (recording.lines[4].get (), 9, '9', 1);
  play ();
  EXPECT_TRUE (corrupted (4));
  EXPECT_EQ (counted (file.element (), "lines-damaged"), 1u);
}

TEST_F (Restore, ALossThatTheRecordingHasIsSaidOnce)
{
  play ();
  const auto lost = file.posted<FramesLost> ();
  ASSERT_TRUE (lost);
  EXPECT_EQ (lost->count, 2u);
  EXPECT_EQ (lost->to, kPeriod);
  EXPECT_FALSE (file.posted<FramesLost> ());
  EXPECT_EQ (get_frame_meta (restored[1].get ())->lost_before, 2u);
}

TEST_F (Restore, AFrameThatCameLateIsNoRepetition)
{
  recording = Recording ({0, 1, 2, 4, 3, 5});
  play ();
  EXPECT_EQ (GST_BUFFER_PTS (restored.at (4).get ()), 3 * kPeriod);
  EXPECT_EQ (counted (file.element (), "frames-damaged"), 0u);
}

TEST_F (Restore, AfterALateFrameNothingIsMissing)
{
  recording = Recording ({0, 1, 2, 3, 4, 5}, {10, 11, 13, 12, 14, 15});
  play ();
  for (const std::size_t i : {3, 4, 5})
    EXPECT_EQ (get_frame_meta (restored.at (i).get ())->lost_before, 0u) << i;
}

/* As those without a meta, which are counted as they come. */
TEST_F (Restore, BehindALateFrameOfALaterNumberNothingIsMissing)
{
  recording = Recording ({0, 1, 3, 2, 4, 5}, {10, 11, 13, 12, 14, 15});
  play ();
  for (const std::size_t i : {3, 4, 5})
    EXPECT_EQ (get_frame_meta (restored.at (i).get ())->lost_before, 0u) << i;
  EXPECT_FALSE (GST_BUFFER_IS_DISCONT (restored[4].get ()));
}

TEST_F (Restore, AFrameThatIsMissingIsSaid)
{
  play (4);
  ASSERT_EQ (restored.size (), std::size_t (kFrames - 1));
  EXPECT_TRUE (GST_BUFFER_IS_DISCONT (restored[4].get ()));
  EXPECT_EQ (get_frame_meta (restored[4].get ())->lost_before, 1u);
  const auto missing = file.posted<FramesMissing> ();
  ASSERT_TRUE (missing);
  EXPECT_EQ (missing->count, 1u);
  EXPECT_EQ (missing->from, 4 * kPeriod);
}

TEST_F (Restore, AMissingLastFrameIsSaid)
{
  play (kFrames - 1);
  ASSERT_TRUE (file.posted<FramesMissing> ());
}

TEST_F (Restore, FramesThatAreMissingWithTheirLinesAreSaid)
{
  play (0, 0);
  ASSERT_EQ (restored.size (), std::size_t (kFrames - 1));
  const auto incomplete = file.posted<StreamIncomplete> ();
  ASSERT_TRUE (incomplete);
  EXPECT_EQ (incomplete->count, 1u);
  EXPECT_EQ (counted (file.element (), "frames-missing"), 1u);
  EXPECT_FALSE (file.posted<FramesMissing> ());
}

TEST_F (Restore, WithoutTheLastLineTheStreamWasCut)
{
  play (-1, kFrames);
  const auto cut = file.posted<StreamCut> ();
  ASSERT_TRUE (cut);
  EXPECT_EQ (cut->frames, guint64 (kFrames));
}

TEST_F (Restore, LinesMayComeAfterTheirFrames)
{
  for (int i = 0; i < kFrames; i++) {
    push_frame (i);
    push_line (i);
  }
  push_line (kFrames);
  end ();
  for (int i = 0; i < kFrames; i++) {
    restored.push_back (file.pull ());
    ASSERT_TRUE (restored.back ()) << i;
    EXPECT_EQ (corrupted (i), i == 2) << i;
  }
}

TEST_F (Restore, TheScheduleOfTheTrackWinsAndADifferenceIsSaid)
{
  file.push_event (setup_to_event (setup_of ("sequential:4x1")));
  play ();
  EXPECT_EQ (schedule (), "staircase:2x2");
  EXPECT_NE (file.warning ().find ("sequential:4x1"), std::string::npos);
}

TEST_F (Restore, WithoutALineTheContainersScheduleIsUsed)
{
  file.push_event (setup_to_event (setup_of ("sequential:4x1")));
  for (int i = 0; i < 2; i++)
    recording.lines[std::size_t (i)].reset (gst_buffer_new ());
  push_frame (0);
  push_line (0);
  push_line (2);
  push_frame (1);
  EXPECT_EQ (schedule (), "sequential:4x1");
}

TEST_F (Restore, TheSecondLineHasTheScheduleAgain)
{
  play (-1, 0);
  EXPECT_EQ (schedule (), "staircase:2x2");
}

TEST_F (Restore, MarkupIsUnescaped)
{
  const CapsPtr caps (gst_caps_from_string ("text/x-raw,format=pango-markup"));
  gst_harness_push_event (track.get (), gst_event_new_caps (caps.get ()));
  for (BufferPtr &line : recording.lines) {
    GstMapInfo map;
    gst_buffer_map (line.get (), &map, GST_MAP_READ);
    const CharPtr escaped (g_markup_escape_text (
        reinterpret_cast<const char *> (map.data), gssize (map.size)));
    gst_buffer_unmap (line.get (), &map);
    GstBuffer *text =
        gst_buffer_new_memdup (escaped.get (), strlen (escaped.get ()));
    gst_buffer_copy_into (text, line.get (), GST_BUFFER_COPY_TIMESTAMPS, 0, -1);
    line.reset (text);
  }
  play ();
  EXPECT_FALSE (corrupted (0));
  EXPECT_EQ (schedule (), "staircase:2x2");
}

/* From the last frame to the first, as in reverse playback. */
TEST_F (Restore, BackwardsTheFlagsAreThoseOfForwards)
{
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.rate = -1;
  segment.stop = kFrames * kPeriod;
  file.push_event (gst_event_new_segment (&segment));
  for (int i = kFrames - 1; i >= 0; i--) {
    push_line (i);
    push_frame (i);
  }
  end ();
  while (BufferPtr frame = file.pull ())
    restored.push_back (std::move (frame));
  ASSERT_EQ (restored.size (), std::size_t (kFrames));
  for (int i = 0; i < kFrames; i++)
    EXPECT_EQ (corrupted (kFrames - 1 - i), i == 2) << i;
  EXPECT_FALSE (file.posted<FramesMissing> ());
  EXPECT_FALSE (file.posted<StreamCut> ());
}

/* Key units only, for example. */
TEST_F (Restore, FramesThatAreLeftOutOnPurposeAreNotMissed)
{
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.flags = GST_SEGMENT_FLAG_TRICKMODE_KEY_UNITS;
  file.push_event (gst_event_new_segment (&segment));
  play (4);
  EXPECT_FALSE (corrupted (4));
  EXPECT_FALSE (file.posted<FramesMissing> ());
  EXPECT_FALSE (file.posted<StreamIncomplete> ());
}

/** One whose JSON form has more than 512 bytes. */
StreamSetup
long_setup (int first)
{
  std::string order;
  for (int i = 0; i < 256; i++)
    order += (i > 0 ? "/" : "") + std::to_string ((first + i) % 256);
  return {*Schedule::parse ("sequential:16x16,order=" + order)};
}

/** Changes of the schedule: two frames by each. */
struct Changing {
  std::vector<BufferPtr> frames, lines;
  std::vector<StreamSetup> setups;

  Changing ()
  {
    ElementHarness log ("part-log location=/dev/null");
    log.request ("track");
    log.set_caps (gray_caps (8, 8));
    for (int i = 0; i < 6; i++) {
      const StreamSetup setup = long_setup (i % 4 < 2 ? 1 : 2);
      if (i % 2 == 0)
        log.push_event (setup_to_event (setup));
      setups.push_back (setup);
      BufferPtr frame = picture (i);
      set_frame_meta (frame.get (), meta_of (i));
      log.push (std::move (frame));
      frames.push_back (log.pull ());
      lines.push_back (log.pull ("track"));
    }
    for (int i = 0; i < 6; i++)
      gst_buffer_unset_flags (
          frames[std::size_t (i)].get (), GST_BUFFER_FLAG_DISCONT);
  }
};

/* The line that has the new schedule is lost. */
TEST (RestoreOfChanges, AFrameWhoseScheduleIsUnknownIsCorrupted)
{
  for (const bool tags : {false, true}) {
    Changing recording;
    ElementHarness file ("part-restore");
    const HarnessPtr track (
        gst_harness_new_with_element (file.element (), "track", nullptr));
    gst_harness_set_src_caps_str (track.get (), "text/x-raw,format=utf8");
    file.set_caps (gray_caps (8, 8));
    if (tags)
      file.push_event (add_setups (setup_to_event (recording.setups[0]),
          {recording.setups[2], recording.setups[0]}));
    std::vector<BufferPtr> restored;
    for (std::size_t i = 0; i < 6; i++) {
      if (i != 2)
        gst_harness_push (track.get (), recording.lines[i].release ());
      file.push (std::move (recording.frames[i]));
    }
    gst_harness_push_event (track.get (), gst_event_new_eos ());
    file.push_event (gst_event_new_eos ());
    while (BufferPtr frame = file.pull ())
      restored.push_back (std::move (frame));
    ASSERT_EQ (restored.size (), 6u);
    for (std::size_t i = 0; i < 6; i++)
      EXPECT_EQ (bool (GST_BUFFER_FLAG_IS_SET (
                     restored[i].get (), GST_BUFFER_FLAG_CORRUPTED)),
          i == 2 || (i == 3 && !tags))
          << i << (tags ? ", with tags" : "");
    EXPECT_EQ (counted (file.element (), "frames-damaged"), tags ? 0u : 1u);
  }
}

/** A setup whose recording has a track. */
StreamSetup
with_track (const char *schedule)
{
  StreamSetup setup = setup_of (schedule);
  setup.track = true;
  return setup;
}

TEST_F (Restore, WhatFollowsHasNoTrack)
{
  file.push_event (setup_to_event (with_track ("staircase:2x2")));
  play ();
  const auto last = setup ();
  ASSERT_TRUE (last);
  EXPECT_FALSE (last->track);
  EXPECT_EQ (file.warning (), "");
  EXPECT_FALSE (file.posted<FramesDamaged> ());
}

TEST_F (Restore, ATrackWithoutAnyLineIsDamage)
{
  file.push_event (setup_to_event (with_track ("staircase:2x2")));
  for (int i = 0; i < kFrames; i++)
    push_frame (i);
  end ();
  for (int i = 0; i < kFrames; i++) {
    restored.push_back (file.pull ());
    ASSERT_TRUE (restored.back ()) << i;
    EXPECT_TRUE (corrupted (i)) << i;
  }
  EXPECT_TRUE (file.posted<FramesDamaged> ());
  EXPECT_NE (file.warning ().find ("another copy"), std::string::npos);
}

TEST (RestoreWithoutATrack, AMissingTrackIsDamageIfTheTagsSayThatThereIsOne)
{
  ElementHarness file ("part-restore");
  file.set_caps (gray_caps (8, 8));
  file.push_event (setup_to_event (with_track ("sequential:4x1")));
  for (int i = 0; i < 2; i++)
    ASSERT_EQ (file.push (picture (i)), GST_FLOW_OK);
  file.push_event (gst_event_new_eos ());
  for (int i = 0; i < 2; i++) {
    const BufferPtr frame = file.pull ();
    ASSERT_TRUE (frame);
    EXPECT_TRUE (
        GST_BUFFER_FLAG_IS_SET (frame.get (), GST_BUFFER_FLAG_CORRUPTED));
    const auto meta = get_frame_meta (frame.get ());
    EXPECT_FALSE (meta) << "its number and synchronisation are unknown";
  }
  EXPECT_EQ (counted (file.element (), "frames-unknown"), 2u);
  const auto begin = file.posted<FramesDamaged> ();
  ASSERT_TRUE (begin);
  EXPECT_TRUE (begin->active);
  EXPECT_EQ (begin->reason, std::string ("its track is missing"));
  const auto over = file.posted<FramesDamaged> ();
  ASSERT_TRUE (over);
  EXPECT_EQ (over->count, 2u);
  EXPECT_NE (file.warning ().find ("another copy"), std::string::npos);
  EXPECT_EQ (file.warning (), "");
}

TEST (RestoreWithoutATrack, FramesPassAndItIsSaidOnce)
{
  ElementHarness file ("part-restore");
  file.set_caps (gray_caps (8, 8));
  file.push_event (setup_to_event (setup_of ("sequential:4x1")));
  for (int i = 0; i < 2; i++)
    ASSERT_EQ (file.push (picture (i)), GST_FLOW_OK);
  EXPECT_TRUE (file.pull_event (GST_EVENT_TAG));
  const BufferPtr frame = file.pull ();
  EXPECT_FALSE (get_frame_meta (frame.get ()));
  EXPECT_FALSE (
      GST_BUFFER_FLAG_IS_SET (frame.get (), GST_BUFFER_FLAG_CORRUPTED));
  EXPECT_NE (file.warning ().find ("unknown"), std::string::npos);
  EXPECT_EQ (file.warning (), "");
}

} // namespace

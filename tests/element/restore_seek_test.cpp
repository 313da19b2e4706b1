/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The part restore after seeks: no frame is there twice, none is missed that
 * was not asked for, and times are those of the stream. */
#include "restored.h"

#include "common/messages.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

GstEvent *
segment_from (GstClockTime start, GstClockTime stream_time)
{
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.start = start;
  segment.time = stream_time;
  return gst_event_new_segment (&segment);
}

class RestoreSeek : public Restore
{
protected:
  /** The frames from @p next on come out once, and nothing is said of them. */
  void expect_each_from (int next)
  {
    while (const BufferPtr frame = file.pull ())
      EXPECT_EQ (
          GST_BUFFER_PTS (frame.get ()), GstClockTime (next++) * kPeriod);
    EXPECT_EQ (next, kFrames);
    EXPECT_EQ (counted (file.element (), "frames-unknown"), 0u);
    EXPECT_EQ (counted (file.element (), "frames-missing"), 0u);
  }
};

/* A demuxer was stopped between a frame and its line, and has read on before
 * the frames get there. If it is sent to that frame, it goes on behind it. */
TEST_F (RestoreSeek, ASeekWithoutAFlushLeavesTheFrameWhoseLineHasNotCome)
{
  Recording again;
  push_line (0);
  push_frame (0);
  push_frame (2);
  gst_harness_push_event (track.get (), segment_from (0, 0));
  for (int i = 1; i < kFrames - 1; i++)
    push_line (i);
  EXPECT_FALSE (file.pull () && file.pull ()) << "the second one waits";
  file.push_event (segment_from (0, 0));
  for (int i = 1; i < kFrames; i++)
    file.push (std::move (again.frames[std::size_t (i)]));
  gst_harness_push_event (track.get (), segment_from (5 * kPeriod, 0));
  file.push_event (segment_from (5 * kPeriod, 0));
  push_line (5);
  end ();
  expect_each_from (1);
}

/* The demuxer was sent to a frame, and had read it before it stopped. */
TEST_F (RestoreSeek, AFrameThatASeekWithoutAFlushGoesBackToIsThereOnce)
{
  Recording again;
  push_line (0);
  push_frame (0);
  push_frame (1);
  gst_harness_push_event (track.get (), segment_from (kPeriod, 0));
  file.push_event (segment_from (kPeriod, 0));
  for (int i = 1; i < kFrames; i++) {
    file.push (std::move (again.frames[std::size_t (i)]));
    push_line (i);
  }
  end ();
  expect_each_from (0);
}

/* It read a further one before it stopped, and goes on behind it. */
TEST_F (RestoreSeek, AFrameThatASeekWithoutAFlushGoesOnBehindIsThere)
{
  push_line (0);
  push_frame (0);
  push_frame (1);
  gst_harness_push_event (track.get (), segment_from (0, 0));
  file.push_event (segment_from (0, 0));
  for (int i = 1; i < kFrames; i++) {
    push_line (i);
    if (i + 1 < kFrames)
      push_frame (i + 1);
  }
  end ();
  expect_each_from (0);
}

TEST_F (Restore, AfterASeekTheFramesBeforeItAreNotMissed)
{
  file.push_event (gst_event_new_flush_start ());
  file.push_event (gst_event_new_flush_stop (TRUE));
  file.push_event (segment_from (0, 0));
  play (0, 0);
  EXPECT_FALSE (file.posted<StreamIncomplete> ());
}

/* A decoder keeps the segment if no frame of it comes. */
TEST_F (Restore, ASeekToWhereNoFrameIsDoesNotCutTheStream)
{
  push_line (0);
  push_frame (0);
  for (const auto &pad : {track.get (), file.get ()}) {
    gst_harness_push_event (pad, gst_event_new_flush_start ());
    gst_harness_push_event (pad, gst_event_new_flush_stop (TRUE));
  }
  end ();
  EXPECT_FALSE (file.posted<StreamCut> ());
}

TEST_F (Restore, AFrameWhoseTimeTheFileRoundedUpStaysInTheSegment)
{
  g_object_set (file.element (), "tick", guint64 (1000), nullptr);
  constexpr GstClockTime kRounded = kPeriod + 400;
  GstSegment segment;
  file.push_event (segment_from (kRounded, kRounded));
  GST_BUFFER_PTS (recording.frames[1].get ()) = kRounded;
  play (0, 0);
  while (const EventPtr event = file.pull_event (GST_EVENT_SEGMENT))
    gst_event_copy_segment (event.get (), &segment);
  for (GstClockTime n = 0; n < restored.size (); n++) {
    const GstClockTime time = GST_BUFFER_PTS (restored[n].get ());
    EXPECT_EQ (time, (n + 1) * kPeriod);
    EXPECT_EQ (gst_segment_to_running_time (&segment, GST_FORMAT_TIME, time),
        n * kPeriod);
    EXPECT_EQ (
        gst_segment_to_stream_time (&segment, GST_FORMAT_TIME, time), time);
  }
}

TEST_F (Restore, AfterASeekTheTimeOfTheStreamIsTheSame)
{
  g_object_set (file.element (), "tick", guint64 (1000), nullptr);
  const auto time_of_second_frame = [this] (GstClockTime start) {
    GstSegment segment;
    file.push_event (segment_from (start, start - kPeriod / 2));
    while (const EventPtr event = file.pull_event (GST_EVENT_SEGMENT))
      gst_event_copy_segment (event.get (), &segment);
    return gst_segment_to_stream_time (&segment, GST_FORMAT_TIME, 2 * kPeriod);
  };
  const guint64 whole = time_of_second_frame (kPeriod / 2);
  EXPECT_EQ (whole, time_of_second_frame (kPeriod));
  EXPECT_GE (whole, 2 * kPeriod - kPeriod / 2);
}

TEST_F (Restore, ExactTimesStayAsTheyAre)
{
  GstSegment segment;
  file.push_event (segment_from (kPeriod, kPeriod / 2));
  const EventPtr event = file.pull_event (GST_EVENT_SEGMENT);
  const EventPtr last = file.pull_event (GST_EVENT_SEGMENT);
  gst_event_copy_segment (last ? last.get () : event.get (), &segment);
  EXPECT_EQ (segment.start, kPeriod);
}

} // namespace

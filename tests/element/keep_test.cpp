/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-keep: what has just happened becomes a recording. */
#include <climits>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "common/messages.h"
#include "common/meta.h"
#include "common/tag.h"
#include "pipeline.h"
#include "preset.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr int kSide = 16;
constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
/* A camera's recording begins late. */
constexpr GstClockTime kBegin = 700 * GST_SECOND;

/* Of a recording. */
struct Frames {
  std::vector<GstClockTime> times;
  std::vector<int> values; ///< of the first pixel
  std::vector<guint64> numbers;
};

void
take (GstElement *, GstBuffer *buffer, GstPad *, gpointer data)
{
  auto *frames = static_cast<Frames *> (data);
  frames->times.push_back (GST_BUFFER_PTS (buffer));
  guint8 value = 0;
  gst_buffer_extract (buffer, 0, &value, 1);
  frames->values.push_back (value);
  frames->numbers.push_back (get_frame_meta (buffer).value ().frame);
}

class Keep : public ::testing::Test
{
protected:
  Keep ()
  {
    std::string name = ::testing::TempDir () + "/keep_XXXXXX";
    folder_ = mkdtemp (name.data ());
  }
  ~Keep () override { std::filesystem::remove_all (folder_); }

  std::string file (const std::string &name) const
  {
    return folder_ + "/" + name;
  }
  void begin (const std::string &properties = "")
  {
    keep_.emplace (
        "codedexposure-keep location=" + file ("event") + " " + properties);
    keep_->set_caps (gray_caps (kSide, kSide));
    tell ("sequential:2x2");
  }
  void tell (const std::string &preset)
  {
    StreamSetup setup;
    setup.schedule = schedule_of (preset);
    keep_->push_event (setup_to_event (setup));
  }
  void push (guint64 number, int value)
  {
    BufferPtr frame (gst_buffer_new_allocate (nullptr, kSide * kSide, nullptr));
    gst_buffer_memset (frame.get (), 0, guint8 (value), kSide * kSide);
    GST_BUFFER_PTS (frame.get ()) = kBegin + number * kPeriod;
    GST_BUFFER_DURATION (frame.get ()) = kPeriod;
    FrameMeta meta;
    meta.frame = number;
    meta.exposure_start = GST_BUFFER_PTS (frame.get ());
    meta.exposure_duration = kPeriod;
    set_frame_meta (frame.get (), meta);
    ASSERT_EQ (keep_->push (std::move (frame)), GST_FLOW_OK);
  }
  void push_all (guint64 first, guint64 last, int value = 50)
  {
    for (guint64 k = first; k <= last; k++)
      push (k, value);
  }
  void push_all_back (guint64 first, guint64 last, int value = 50)
  {
    for (guint64 k = first + 1; k-- > last;)
      push (k, value);
  }
  void flush ()
  {
    keep_->push_event (gst_event_new_flush_start ());
    keep_->push_event (gst_event_new_flush_stop (TRUE));
    push_segment (1);
  }
  void push_segment (double rate)
  {
    GstSegment segment;
    gst_segment_init (&segment, GST_FORMAT_TIME);
    segment.rate = rate;
    keep_->push_event (gst_event_new_segment (&segment));
  }
  /* What was asked for before is written then. */
  void end () { keep_->push_event (gst_event_new_eos ()); }
  void keep () { g_object_set (keep_->element (), "keep", TRUE, nullptr); }

  Frames read (const std::string &name) const
  {
    Pipeline pipeline ("filesrc location=" + file (name) +
                       " ! codedexposure-recorddemux ! fakesink name=end "
                       "signal-handoffs=true");
    Frames frames;
    g_signal_connect (
        pipeline["end"].get (), "handoff", G_CALLBACK (take), &frames);
    EXPECT_EQ (pipeline.play (), "");
    return frames;
  }
  std::size_t files () const
  {
    return std::size_t (
        std::distance (std::filesystem::directory_iterator (folder_), {}));
  }

  std::string folder_;
  std::optional<ElementHarness> keep_;
};

TEST_F (Keep, MakesARecordingOfTheLastFrames)
{
  begin ("length=400000000");
  push_all (3, 30);
  keep ();
  EXPECT_TRUE (property<gboolean> (keep_->element (), "keep"));
  end ();
  const auto kept = keep_->posted<Kept> ();
  ASSERT_TRUE (kept);
  EXPECT_EQ (kept->location, file ("event-frame000020.mkv"));
  EXPECT_EQ (kept->frames, 11u);
  EXPECT_EQ (kept->frame, 20u);
  EXPECT_EQ (kept->duration, 10 * kPeriod);
  EXPECT_FALSE (property<gboolean> (keep_->element (), "keep"));
  EXPECT_EQ (property<guint64> (keep_->element (), "recordings"), 1u);

  const Frames frames = read ("event-frame000020.mkv");
  ASSERT_EQ (frames.numbers.size (), 11u);
  for (std::size_t k = 0; k < 11; k++) {
    EXPECT_EQ (frames.numbers[k], 20 + k);
    EXPECT_EQ (frames.times[k], kBegin + (20 + k) * kPeriod);
  }
  EXPECT_TRUE (std::filesystem::exists (file ("event-frame000020.jsonl")));
  EXPECT_EQ (keep_->pull_all ().size (), 28u); // all pass
  EXPECT_EQ (keep_->warning (), "");
}

TEST_F (Keep, ReplacesNoFileAndLeavesNoOther)
{
  begin ();
  push_all (0, 3);
  keep ();
  end ();
  begin ();
  push_all (0, 7);
  keep ();
  end ();
  EXPECT_EQ (keep_->posted<Kept> ().value ().location,
      file ("event-frame000000-2.mkv"));
  EXPECT_EQ (read ("event-frame000000.mkv").numbers.size (), 4u);
  EXPECT_EQ (read ("event-frame000000-2.mkv").numbers.size (), 8u);
  EXPECT_EQ (files (), 4u); // two of lines
}

TEST_F (Keep, WhatAKilledRunLeftIsInNobodysWay)
{
  std::ofstream (file ("event-frame000000.mkv.part")) << "left";
  std::ofstream (file ("event-frame000000-2.jsonl.part")) << "left";
  begin ();
  push_all (0, 3);
  keep ();
  end ();
  EXPECT_EQ (keep_->posted<Kept> ().value ().location,
      file ("event-frame000000-3.mkv"));
  EXPECT_EQ (files (), 4u);
}

TEST_F (Keep, FollowsAnEventForItsTime)
{
  begin ("event=mean:20 after=400000000");
  push_all (0, 40, 50);
  push_all (41, 80, 150);
  const auto event = keep_->posted<EventFound> ();
  ASSERT_TRUE (event);
  EXPECT_EQ (event->kind, "mean");
  EXPECT_EQ (event->frame, 41u);
  EXPECT_EQ (event->time, kBegin + 41 * kPeriod);
  EXPECT_NEAR (event->jump, 100 / 255.0, 1e-6);
  EXPECT_EQ (event->after, 10 * kPeriod);
  end ();
  ASSERT_TRUE (keep_->posted<Kept> ());
  EXPECT_FALSE (keep_->posted<Kept> ()); // it was one event
  const Frames frames = read ("event-frame000000.mkv");
  ASSERT_EQ (frames.values.size (), 52u);
  EXPECT_EQ (frames.values[40], 50);
  EXPECT_EQ (frames.values[41], 150);
}

TEST_F (Keep, AnEventAtTheEndIsKeptWithWhatThereIs)
{
  for (const bool by_state : {false, true}) {
    begin ("event=motion:10");
    push_all (0, 30, 50);
    push_all (31, 33, 150);
    if (by_state)
      gst_element_set_state (keep_->element (), GST_STATE_READY);
    else
      end ();
    const auto kept = keep_->posted<Kept> ();
    ASSERT_TRUE (kept) << by_state;
    EXPECT_EQ (kept->frames, 34u);
  }
}

TEST_F (Keep, OnlyFramesOfOneFormatAndSetup)
{
  begin ();
  push_all (0, 4);
  tell ("sequential:2x2"); // repeated
  push_all (5, 6);
  tell ("sequential:3x3");
  push_all (7, 9);
  keep ();
  end ();
  EXPECT_EQ (keep_->posted<Kept> ().value ().frame, 7u);
  begin ();
  push_all (0, 4);
  flush ();
  keep ();
  end ();
  EXPECT_EQ (keep_->warning (), "There is no coded frame to be kept yet; keep "
                                "again when frames have come.");
  EXPECT_FALSE (property<gboolean> (keep_->element (), "keep"));
}

TEST_F (Keep, AnEventIsKeptBeforeAnotherSetup)
{
  begin ("event=mean:20");
  push_all (0, 30, 50);
  push_all (31, 33, 150);
  tell ("sequential:3x3");
  push_all (34, 36, 150);
  end ();
  const auto kept = keep_->posted<Kept> ();
  ASSERT_TRUE (kept);
  EXPECT_EQ (kept->frames, 34u);
  EXPECT_FALSE (keep_->posted<Kept> ());
}

TEST_F (Keep, AnEventIsKeptBeforeAFlush)
{
  begin ("event=mean:20");
  push_all (0, 30, 50);
  push_all (31, 33, 150);
  flush ();
  push_all (100, 102, 150);
  keep ();
  end ();
  EXPECT_EQ (keep_->posted<Kept> ().value ().frames, 34u);
  EXPECT_EQ (keep_->posted<Kept> ().value ().frame, 100u);
}

TEST_F (Keep, AnotherPlaceOrSetupIsNoEvent)
{
  begin ("event=mean:20");
  push_all (0, 30, 50);
  flush ();
  push_all (100, 130, 150);
  push_segment (1);
  push_all (60, 90, 50);
  tell ("sequential:3x3");
  push_all (91, 120, 150);
  EXPECT_FALSE (keep_->posted<EventFound> ());
  push_all (121, 122, 50);
  EXPECT_TRUE (keep_->posted<EventFound> ());
  end ();
}

TEST_F (Keep, FramesThatComeBackwardsAreKeptInTheOrderOfTime)
{
  begin ("length=400000000");
  push_segment (-1);
  push_all_back (30, 3);
  keep ();
  end ();
  const auto kept = keep_->posted<Kept> ();
  ASSERT_TRUE (kept);
  EXPECT_EQ (kept->frame, 3u);
  EXPECT_EQ (kept->frames, 11u);
  EXPECT_EQ (kept->duration, 10 * kPeriod);
  const Frames frames = read ("event-frame000003.mkv");
  ASSERT_EQ (frames.numbers.size (), 11u);
  for (std::size_t k = 0; k < 11; k++) {
    EXPECT_EQ (frames.numbers[k], 3 + k);
    EXPECT_EQ (frames.times[k], kBegin + (3 + k) * kPeriod);
  }
}

TEST_F (Keep, FollowsAnEventBackwardsForItsTime)
{
  begin ("event=mean:20 after=400000000");
  push_segment (-1);
  push_all_back (80, 41, 50);
  push_all_back (40, 0, 150);
  end ();
  const auto kept = keep_->posted<Kept> ();
  ASSERT_TRUE (kept);
  EXPECT_EQ (kept->frame, 30u);
  EXPECT_EQ (kept->frames, 51u);
}

TEST_F (Keep, FindsMotionBackwards)
{
  begin ("event=motion:20 after=400000000");
  push_segment (-1);
  push_all_back (80, 41, 50);
  push_all_back (40, 0, 150);
  end ();
  EXPECT_EQ (keep_->posted<EventFound> ().value ().frame, 40u);
  EXPECT_EQ (keep_->posted<Kept> ().value ().frame, 30u);
}

TEST_F (Keep, ASegmentThatGoesBackOrTheOtherWayBeginsAnew)
{
  begin ();
  push_all (0, 10);
  push_segment (1);
  push_all (4, 8);
  push_segment (1); // it goes on
  push_all (9, 12);
  keep ();
  end ();
  const auto forwards = keep_->posted<Kept> ();
  ASSERT_TRUE (forwards);
  EXPECT_EQ (forwards->frame, 4u);
  EXPECT_EQ (forwards->frames, 9u);

  begin ("event=mean:20");
  push_all (0, 30, 50);
  push_all (31, 33, 150);
  push_segment (-1);
  push_all_back (32, 28, 150);
  keep ();
  end ();
  EXPECT_EQ (keep_->posted<Kept> ().value ().frames, 34u);
  EXPECT_EQ (keep_->posted<Kept> ().value ().frames, 5u);
}

TEST_F (Keep, ATimeThatIsLongerThanWhatIsRememberedIsRefused)
{
  const ObjectPtr<GstElement> element (GST_ELEMENT (gst_object_ref_sink (
      gst_element_factory_make ("codedexposure-keep", nullptr))));
  g_object_set (element.get (), "event", "mean:5", "after",
      guint64 (2 * GST_SECOND), "length", guint64 (GST_SECOND), nullptr);
  EXPECT_NE (refusal (element.get (), GST_STATE_PAUSED)
                 .find ("would be forgotten before it is kept"),
      std::string::npos);
  gst_element_set_state (element.get (), GST_STATE_NULL);
}

TEST_F (Keep, MemoryIsBounded)
{
  begin ("max-bytes=1300"); // five frames
  push_all (0, 30);
  keep ();
  end ();
  EXPECT_EQ (keep_->posted<Kept> ().value ().frames, 5u);
}

TEST_F (Keep, AnEventIsKeptBeforeMemoryForgetsIt)
{
  begin ("event=mean:20 max-bytes=1300"); // five frames
  push_all (0, 40, 50);
  push_all (41, 80, 150);
  end ();
  EXPECT_EQ (keep_->posted<Kept> ().value ().frame, 41u);
  const Frames frames = read ("event-frame000041.mkv");
  EXPECT_EQ (frames.numbers, (std::vector<guint64>{41, 42, 43, 44, 45}));
}

TEST_F (Keep, WithMemoryForOneFrameAnEventIsThatFrame)
{
  begin ("event=mean:20 max-bytes=1");
  push_all (0, 40, 50);
  push_all (41, 80, 150);
  end ();
  EXPECT_EQ (keep_->posted<Kept> ().value ().frame, 41u);
  EXPECT_EQ (read ("event-frame000041.mkv").values, std::vector<int>{150});
}

/* 200 of 4095 are 5 %, and of 65535 less than 1. */
TEST_F (Keep, TheTagsSayTheBitsOfFramesWithoutMetadata)
{
  begin ("event=mean:3");
  keep_->set_caps (gray_caps (kSide, kSide, "25/1", "GRAY16_LE"));
  StreamSetup setup;
  setup.schedule = schedule_of ("sequential:2x2");
  setup.bits = 12;
  keep_->push_event (setup_to_event (setup));
  for (int k = 0; k < 60; k++)
    ASSERT_EQ (keep_->push (frame_of (
                   draw<std::uint16_t> (kSide, kSide,
                       [k] (int, int) { return k < 50 ? 1000 : 1200; }),
                   k * kPeriod)),
        GST_FLOW_OK);
  const auto event = keep_->posted<EventFound> ();
  ASSERT_TRUE (event);
  EXPECT_FALSE (event->frame);
  EXPECT_NEAR (event->jump, 200 / 4095.0, 1e-6);
  end ();
}

TEST_F (Keep, FramesWithoutATimeAreSaidOnce)
{
  begin ();
  for (int k = 0; k < 3; k++)
    ASSERT_EQ (keep_->push (frame_of (
                   Image<std::uint8_t> (kSide, kSide), GST_CLOCK_TIME_NONE)),
        GST_FLOW_OK);
  EXPECT_NE (keep_->warning ().find ("no time stamp"), std::string::npos);
  EXPECT_EQ (keep_->warning (), "");
}

TEST_F (Keep, WhatCannotBeWrittenIsSaid)
{
  begin ();
  g_object_set (keep_->element (), "location", "/proc/none/event", nullptr);
  push_all (0, 3);
  keep ();
  end ();
  EXPECT_EQ (keep_->warning (),
      "cannot write /proc/none/event-frame000000.mkv: No such file or "
      "directory; choose a folder that you can write to.");
  EXPECT_EQ (property<guint64> (keep_->element (), "recordings"), 0u);
}

TEST_F (Keep, WhatCannotBeRecordedIsSaidWithItsOwnRemedy)
{
  begin ();
  push (gst_util_uint64_scale (G_MAXINT64, 1, kPeriod), 50);
  keep ();
  end ();
  const std::string said = keep_->warning ();
  EXPECT_TRUE (said.ends_with ("Let the source begin its times near 0."))
      << said;
  EXPECT_EQ (files (), 0u);
}

/* The name of the lines is longer by two letters. */
TEST_F (Keep, WithoutItsLinesNothingIsLeftOfARecording)
{
  begin ();
  const std::string name (NAME_MAX - sizeof "-frame000000.mkv.part" + 1, 'a');
  g_object_set (keep_->element (), "location", file (name).c_str (), nullptr);
  push_all (0, 3);
  keep ();
  end ();
  EXPECT_NE (keep_->warning (), "");
  EXPECT_EQ (files (), 0u);
}

TEST_F (Keep, AnEventThatIsNoneIsRefused)
{
  const ObjectPtr<GstElement> element (GST_ELEMENT (gst_object_ref_sink (
      gst_element_factory_make ("codedexposure-keep", nullptr))));
  g_object_set (element.get (), "event", "light:5", nullptr);
  EXPECT_NE (refusal (element.get (), GST_STATE_PAUSED)
                 .find ("\"light:5\" is not an event such as mean:10"),
      std::string::npos);
  gst_element_set_state (element.get (), GST_STATE_NULL);
}

TEST_F (Keep, ARegionOutsideOfTheFramesIsSaid)
{
  begin ("event=mean:5@64x64");
  EXPECT_EQ (keep_->warning (),
      "The region 64x64+0+0 is not within the frames of 16x16 pixels, so no "
      "event is seen. Set another region.");
}

} // namespace

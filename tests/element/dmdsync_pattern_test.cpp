/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync shows patterns on request from downstream, marks their frames, and
 * returns to the schedule. */
#include <algorithm>
#include <array>

#include "calibrate/gratings.h"
#include "common/events.h"
#include "dmd/simulated_dmd.h"
#include "sync_bench.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

/** Frames are exposed as fast as they can be, and the thread that moves the
 * mirrors may have to wait for its turn meanwhile. */
constexpr int kPatience = 100'000;

void
white (std::int64_t, ImageView<std::uint8_t> out)
{
  for (int y = 0; y < out.height; y++)
    std::fill_n (out.row (y), out.width, std::uint8_t (255));
}

GstEvent *
request (const char *pattern, guint64 frames = 100)
{
  return gst_event_new_custom (GST_EVENT_CUSTOM_UPSTREAM,
      gst_structure_new ("dmdsync/pattern", "pattern", G_TYPE_STRING, pattern,
          "frames", G_TYPE_UINT64, frames, nullptr));
}

std::string
line_of (const std::string &schedule, const std::string &options = "")
{
  return "codedexposure-sim dmd=sim:bench ! dmdsync name=sync "
         "device=sim:bench" +
         options + " schedule=" + schedule;
}

class PatternTest : public ::testing::TestWithParam<const char *>
{
protected:
  Bench bench{GetParam (), line_of (GetParam ())};

  FrameMeta next ()
  {
    frame = bench.next (white);
    return frame ? get_frame_meta (frame.get ()).value_or (FrameMeta ())
                 : FrameMeta ();
  }
  /** The first frame with metadata of @p pattern; frames before are those of
   * the switch. */
  FrameMeta wait_for (const std::string &pattern)
  {
    for (int i = 0; i < kPatience; i++) {
      const FrameMeta meta = next ();
      if (meta.pattern != kSwitch) {
        EXPECT_EQ (meta.pattern, pattern);
        return meta;
      }
      EXPECT_EQ (meta.locked, false);
    }
    ADD_FAILURE () << pattern << " never came";
    return {};
  }
  void wait_for_schedule ()
  {
    for (int i = 0; i < kPatience; i++) {
      const FrameMeta meta = next ();
      if (meta.pattern.empty ()) {
        EXPECT_NE (meta.locked, false);
        return;
      }
      EXPECT_EQ (meta.pattern, kSwitch);
    }
    ADD_FAILURE () << "the schedule never came back";
  }
  Image<std::uint8_t> pixels ()
  {
    return image_of<std::uint8_t> (
        frame.get (), caps_of (gray_caps (kWidth, kHeight)).get ());
  }
  /** White where @p pattern is on, black elsewhere. */
  static Image<std::uint8_t> drawn (const char *pattern)
  {
    const Pattern parsed = *Pattern::parse (pattern);
    return draw<std::uint8_t> (kWidth, kHeight,
        [&] (int x, int y) { return parsed.on (x, y) ? 255 : 0; });
  }

  BufferPtr frame;
};

INSTANTIATE_TEST_SUITE_P (Schedules, PatternTest,
    ::testing::Values ("sequential:2x2", "staircase:2x2",
        "sequential:2x2,pilot=16", "s-matrix:7x1"));

} // namespace

TEST_P (PatternTest, IsShownOneAfterTheOtherAndTheMirrorsComeBack)
{
  /* Two frames, because the pattern of a pilot has two. */
  std::array<Image<std::uint8_t>, 2> coded;
  for (int i = 0; i < 2; i++) {
    const FrameMeta meta = next ();
    ASSERT_NE (meta.locked, false);
    coded[meta.frame % 2] = pixels ();
  }
  for (const char *pattern :
      {"grating-x:4/1", "gray-y:6/2-inverse", "dark", "white"}) {
    SCOPED_TRACE (pattern);
    ASSERT_TRUE (bench.send_upstream (request (pattern)));
    const FrameMeta first = wait_for (pattern);
    EXPECT_EQ (pixels (), drawn (pattern));
    EXPECT_EQ (next ().pattern, pattern);
    EXPECT_EQ (pixels (), drawn (pattern));

    const auto said = bench.messages ("dmdsync/pattern-shown");
    ASSERT_FALSE (said.empty ());
    EXPECT_EQ (string_field (said.back (), "pattern"), pattern);
    EXPECT_EQ (uint64_field (said.back (), "frame"), first.frame);
  }
  ASSERT_TRUE (bench.send_upstream (request ("")));
  wait_for_schedule ();
  const FrameMeta last = next ();
  EXPECT_EQ (pixels (), coded[last.frame % 2]);
  EXPECT_EQ (bench.messages ("dmdsync/pattern-over").size (), 1u);
  EXPECT_EQ (bench.counter ("slips"), 0u);
  EXPECT_EQ (bench.counter ("frames-lost"), 0u);
}

TEST_P (PatternTest, EndsAfterTheFramesThatWereAskedFor)
{
  next ();
  ASSERT_TRUE (bench.send_upstream (request ("white", 3)));
  wait_for ("white");
  EXPECT_EQ (next ().pattern, "white");
  EXPECT_EQ (next ().pattern, "white");
  wait_for_schedule ();
  const auto over = bench.messages ("dmdsync/pattern-over");
  ASSERT_EQ (over.size (), 1u);
  EXPECT_EQ (string_field (over[0], "reason"), "frames");
}

TEST_P (PatternTest, AskedForOnceMoreStaysWithoutAChange)
{
  next ();
  ASSERT_TRUE (bench.send_upstream (request ("white", 3)));
  wait_for ("white");
  for (int i = 0; i < 6; i++) {
    ASSERT_TRUE (bench.send_upstream (request ("white", 3)));
    EXPECT_EQ (next ().pattern, "white");
  }
  EXPECT_TRUE (bench.messages ("dmdsync/pattern-over").empty ());
}

TEST_P (PatternTest, GoesWithAChangeOfState)
{
  next ();
  ASSERT_TRUE (bench.send_upstream (request ("grating-x:4/0")));
  wait_for ("grating-x:4/0");
  bench.restart ();
  const FrameMeta meta = next ();
  EXPECT_NE (meta.locked, false);
  EXPECT_EQ (meta.pattern, "");
}

TEST_P (PatternTest, GoesWithTheEndOfTheStream)
{
  next ();
  ASSERT_TRUE (bench.send_upstream (request ("grating-x:4/0")));
  wait_for ("grating-x:4/0");
  bench.end ();
  const auto over = bench.messages ("dmdsync/pattern-over");
  ASSERT_EQ (over.size (), 1u);
  EXPECT_EQ (string_field (over[0], "reason"), "eos");
}

namespace
{

gboolean
ask (SyncHarness &h, const char *pattern)
{
  return gst_harness_push_upstream_event (h.get (), request (pattern));
}

} // namespace

TEST (DmdSyncPattern, GoesWithAFlush)
{
  SyncHarness h ("device=sim:flushed");
  h.start ();
  ASSERT_EQ (h.send (0), GST_FLOW_OK);
  ASSERT_TRUE (ask (h, "grating-x:4/0"));
  h.push_event (gst_event_new_flush_start ());
  h.push_event (gst_event_new_flush_stop (FALSE));
  EXPECT_EQ (
      string_field (h.element_message ("dmdsync/pattern-over"), "reason"),
      "flush");
}

TEST (DmdSyncPattern, TheNextMayBeAskedForWhenOneIsOver)
{
  struct Asker {
    SyncHarness h{"device=sim:again"};
    bool accepted = false;
  } asker;
  asker.h.start ();
  ASSERT_EQ (asker.h.send (0), GST_FLOW_OK);
  ASSERT_TRUE (ask (asker.h, "grating-x:4/0"));
  const ObjectPtr<GstBus> bus (gst_element_get_bus (asker.h.element ()));
  gst_bus_set_sync_handler (
      bus.get (),
      [] (GstBus *, GstMessage *message, gpointer user_data) {
        auto &self = *static_cast<Asker *> (user_data);
        if (gst_message_has_name (message, "dmdsync/pattern-over"))
          self.accepted = ask (self.h, "white");
        return GST_BUS_PASS;
      },
      &asker, nullptr);
  asker.h.set_caps (gray_caps (32, 24));
  gst_bus_set_sync_handler (bus.get (), nullptr, nullptr, nullptr);
  EXPECT_TRUE (asker.accepted);
}

TEST (DmdSyncPattern, IsRefusedWithoutADevice)
{
  SyncHarness h;
  h.start ();
  EXPECT_FALSE (ask (h, "white"));
  EXPECT_EQ (h.warning (), "Cannot show the pattern white: dmdsync drives no "
                           "DMD; set its device property");
}

TEST (DmdSyncPattern, IsRefusedWhereMasksCannotBeSentAtRunTime)
{
  SyncHarness h ("device=sim:fixed,still=no");
  h.start ();
  EXPECT_FALSE (ask (h, "white"));
  EXPECT_EQ (h.warning (),
      "Cannot show the pattern white: sim:fixed takes no masks at run time; "
      "put the pattern on the device by its own software, and leave dmdsync's "
      "device empty");
}

TEST (DmdSyncPattern, IsRefusedWhenItIsNone)
{
  SyncHarness h ("device=sim:some");
  h.start ();
  EXPECT_FALSE (ask (h, "plaid"));
  EXPECT_NE (h.warning ().find ("plaid"), std::string::npos);
}

TEST (DmdSyncPattern, IsRefusedBeforeTheStream)
{
  SyncHarness h ("device=sim:early");
  EXPECT_FALSE (ask (h, "white"));
  EXPECT_NE (h.warning ().find ("no stream yet"), std::string::npos);
}

TEST (DmdSyncPattern, TellsTheSizeOfTheArray)
{
  SyncHarness h ("device=sim:sized,size=640x480");
  h.start ();
  const QueryPtr query (gst_query_new_custom (
      GST_QUERY_CUSTOM, gst_structure_new_empty ("dmdsync/mirrors")));
  ASSERT_TRUE (gst_pad_peer_query (h.get ()->sinkpad, query.get ()));
  const GstStructure *answer = gst_query_get_structure (query.get ());
  int width = 0, height = 0;
  gboolean patterns = FALSE;
  ASSERT_TRUE (gst_structure_get (answer, "width", G_TYPE_INT, &width, "height",
      G_TYPE_INT, &height, "patterns", G_TYPE_BOOLEAN, &patterns, nullptr));
  EXPECT_EQ (width, 640);
  EXPECT_EQ (height, 480);
  EXPECT_TRUE (patterns);
}

/* The DMD triggers no camera while it gets the mask. */
TEST (DmdSyncPattern, FramesThatASwitchTakesAreNotLost)
{
  SyncHarness h ("device=sim:switched,triggers=yes");
  const auto is_switching = [&h] {
    const QueryPtr query (new_query<SwitchAnswer> ());
    EXPECT_TRUE (gst_pad_peer_query (h.get ()->srcpad, query.get ()));
    return parse_query<SwitchAnswer> (query.get ())->switching;
  };
  h.start ();
  h.send_frames (0, 30);
  EXPECT_FALSE (is_switching ());
  ASSERT_TRUE (ask (h, "white"));
  EXPECT_TRUE (is_switching ());
  int frame = 90;
  h.send_frames (frame, frame + 1);
  for (; is_switching () && frame < kPatience; frame++)
    h.send_frames (frame + 1, frame + 2);
  EXPECT_FALSE (is_switching ());
  EXPECT_EQ (h.counter ("frames-lost"), 0u);
  EXPECT_FALSE (h.element_message ("codedexposure/frames-lost"));

  h.send_frames (frame + 1, frame + 200);
  EXPECT_FALSE (h.element_message ("dmdsync/frame-rate"));
  h.send_frames (frame + 203, frame + 204);
  EXPECT_EQ (h.counter ("frames-lost"), 3u);
}

TEST (DmdSyncPattern, FramesOfACameraThatTheDmdDoesNotTriggerAreLostInASwitch)
{
  SyncHarness h ("device=sim:free");
  h.start ();
  h.send_frames (0, 30);
  ASSERT_TRUE (ask (h, "white"));
  h.send_frames (33, 34);
  EXPECT_EQ (h.counter ("frames-lost"), 3u);
  EXPECT_TRUE (h.element_message ("codedexposure/frames-lost"));
}

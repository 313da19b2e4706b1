/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The part log: one correct line of JSON for each frame, written immediately.
 */
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <glib/gstdio.h>
#include <gst/check/gstharness.h>
#include <gst/gst.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "common/meta.h"
#include "common/raii.h"
#include "common/tag.h"
#include "record/track.h"
#include "schedule_tags.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using Json = nlohmann::json;
using Harness = std::unique_ptr<GstHarness, decltype (&gst_harness_teardown)>;

constexpr char kCaps[] =
    "video/x-raw,format=GRAY8,width=8,height=8,framerate=30000/1001";

class LogTest : public ::testing::Test
{
protected:
  LogTest ()
  {
    gchar *name = nullptr;
    const gint file = g_file_open_tmp ("log_test_XXXXXX.jsonl", &name, nullptr);
    EXPECT_GE (file, 0);
    g_close (file, nullptr);
    path_.reset (name);
  }
  ~LogTest () override { std::remove (path_.get ()); }

  void play (const char *location)
  {
    GstElement *element = gst_element_factory_make ("part-log", nullptr);
    g_object_set (element, "location", location, nullptr);
    harness_.reset (gst_harness_new_with_element (element, "sink", "src"));
    gst_object_unref (element);
    gst_harness_set_src_caps_str (harness_.get (), kCaps);
  }

  BufferPtr frame (GstClockTime pts)
  {
    GstBuffer *buffer = gst_harness_create_buffer (harness_.get (), 64);
    gst_buffer_memset (buffer, 0, 0, 64);
    GST_BUFFER_PTS (buffer) = pts;
    return BufferPtr (buffer);
  }
  GstFlowReturn push (BufferPtr buffer)
  {
    return gst_harness_push (harness_.get (), buffer.release ());
  }

  /** The lines that are on disk now. */
  std::vector<Json> lines () const
  {
    std::ifstream file (path_.get ());
    std::vector<Json> lines;
    for (std::string line; std::getline (file, line);)
      lines.push_back (Json::parse (line));
    return lines;
  }

  CharPtr path_;
  Harness harness_{nullptr, gst_harness_teardown};
};

/** The error or warning of an element that is started, or nothing. */
std::pair<GQuark, gint>
error_at_start (const char *location)
{
  const ObjectPtr<GstElement> element (GST_ELEMENT (
      gst_object_ref_sink (gst_element_factory_make ("part-log", nullptr))));
  const ObjectPtr<GstBus> bus (gst_bus_new ());
  gst_element_set_bus (element.get (), bus.get ());
  g_object_set (element.get (), "location", location, nullptr);
  const GstStateChangeReturn result =
      gst_element_set_state (element.get (), GST_STATE_PAUSED);
  std::pair<GQuark, gint> found;
  if (GstMessage *message =
          gst_bus_pop_filtered (bus.get (), GST_MESSAGE_ERROR)) {
    GError *error = nullptr;
    gst_message_parse_error (message, &error, nullptr);
    found = {error->domain, error->code};
    g_error_free (error);
    gst_message_unref (message);
    EXPECT_EQ (result, GST_STATE_CHANGE_FAILURE);
  }
  gst_element_set_state (element.get (), GST_STATE_NULL);
  gst_element_set_bus (element.get (), nullptr);
  return found;
}

TEST_F (LogTest, WritesWhatTheMetaSays)
{
  play (path_.get ());
  BufferPtr buffer = frame (80 * GST_MSECOND);
  gst_buffer_memset (buffer.get (), 0, 254, 64);
  gst_buffer_memset (buffer.get (), 20, 255, 5);
  FrameMeta meta;
  meta.frame = 7;
  meta.exposure_start = 80 * GST_MSECOND;
  meta.exposure_duration = 39'200'000;
  meta.locked = true;
  meta.slip = -1;
  meta.lost_before = 2;
  meta.bits = 8;
  meta.time_uncertainty = 47'000;
  meta.pattern = "grating-both:4/0";
  set_frame_meta (buffer.get (), meta);
  GST_BUFFER_FLAG_SET (buffer.get (), GST_BUFFER_FLAG_DISCONT);
  GST_BUFFER_FLAG_SET (buffer.get (), GST_BUFFER_FLAG_CORRUPTED);
  ASSERT_EQ (push (std::move (buffer)), GST_FLOW_OK);

  ASSERT_EQ (lines ().size (), 1u);
  EXPECT_EQ (lines ()[0], Json::parse (R"({"frame": 7, "pts_ns": 80000000,
      "exposure_start_ns": 80000000, "exposure_duration_ns": 39200000,
      "time_uncertainty_ns": 47000, "locked": true, "slip": -1,
      "lost_before": 2, "saturated": 5, "bits": 8,
      "pattern": "grating-both:4/0",
      "flags": ["discont", "corrupted"], "hash": "162b7b9d327aa515"})"));
}

/* A queue before it, for example. */
TEST_F (LogTest, CountsFramesThatWereDroppedAfterTheyWereNumbered)
{
  play (path_.get ());
  const auto push_number = [this] (guint64 number, guint64 lost) {
    BufferPtr buffer = frame (number * 40 * GST_MSECOND);
    FrameMeta meta;
    meta.frame = number;
    meta.lost_before = lost;
    set_frame_meta (buffer.get (), meta);
    ASSERT_EQ (push (std::move (buffer)), GST_FLOW_OK);
  };
  push_number (3, 0);
  push_number (4, 0);
  push_number (9, 1);  // 5 to 8 are missing, of which dmdsync missed one
  push_number (12, 2); // as dmdsync says
  push_number (7, 0);  // comes late
  push_number (0, 0);  // the source began anew
  std::vector<int> lost;
  for (const Json &line : lines ())
    lost.push_back (line.at ("lost_before"));
  EXPECT_EQ (lost, (std::vector{0, 0, 4, 2, 0, 0}));
  GstStructure *stats = nullptr;
  g_object_get (harness_->element, "counters", &stats, nullptr);
  const StructurePtr owned (stats);
  guint64 count = 0;
  EXPECT_TRUE (gst_structure_get_uint64 (stats, "frames-lost", &count));
  EXPECT_EQ (count, 5u);
}

TEST_F (LogTest, LockedIsTrueFalseOrNull)
{
  play (path_.get ());
  for (const std::optional<bool> locked :
      {std::optional (true), std::optional (false), std::optional<bool> ()}) {
    BufferPtr buffer = frame (0);
    set_frame_meta (buffer.get (), {.locked = true});
    set_frame_meta (buffer.get (), {.locked = locked});
    EXPECT_EQ (get_frame_meta (buffer.get ())->locked, locked);
    ASSERT_EQ (push (std::move (buffer)), GST_FLOW_OK);
  }
  ASSERT_EQ (lines ().size (), 3u);
  EXPECT_EQ (lines ()[0].at ("locked"), Json (true));
  EXPECT_EQ (lines ()[1].at ("locked"), Json (false));
  EXPECT_EQ (lines ()[2].at ("locked"), Json (nullptr));
}

TEST_F (LogTest, CountsFramesWithoutMetaAndLeavesOutWhatIsUnknown)
{
  play (path_.get ());
  ASSERT_EQ (push (frame (0)), GST_FLOW_OK);
  ASSERT_EQ (push (frame (33'366'666)), GST_FLOW_OK);
  ASSERT_EQ (push (frame (GST_CLOCK_TIME_NONE)), GST_FLOW_OK);

  ASSERT_EQ (lines ().size (), 3u);
  EXPECT_EQ (lines ()[1],
      Json::parse (R"({"frame": 1, "pts_ns": 33366666, "locked": null,
          "flags": [], "hash": "2ffb6918c12c256e"})"));
  EXPECT_EQ (
      lines ()[2], Json::parse (R"({"frame": 2, "locked": null, "flags": [],
          "hash": "2ffb6918c12c256e"})"));
}

/* Equal to the time stamps of the recording: an offset that an encoder adds to
 * PTS and segment is not included. */
TEST_F (LogTest, TimesAreRunningTimes)
{
  play (path_.get ());
  constexpr GstClockTime kShift = 1000 * 3600 * GST_SECOND;
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  segment.start = kShift;
  gst_harness_push_event (harness_.get (), gst_event_new_segment (&segment));
  ASSERT_EQ (push (frame (kShift + 40 * GST_MSECOND)), GST_FLOW_OK);
  EXPECT_EQ (lines ().at (0).at ("pts_ns"), 40'000'000);
}

TEST_F (LogTest, ASecondRunBeginsAnew)
{
  const Schedule staircase = *Schedule::from_preset ("staircase:2x2");
  play (path_.get ());
  for (int run = 0; run < 2; run++) {
    gst_harness_push_event (harness_.get (), schedule_to_event (staircase));
    for (int i = 0; i < 2; i++)
      ASSERT_EQ (
          push (frame (GstClockTime (i) * 40 * GST_MSECOND)), GST_FLOW_OK);
    ASSERT_EQ (lines ().size (), 3u) << "run " << run;
    EXPECT_EQ (lines ()[0], Json::parse (staircase.to_json ()));
    EXPECT_EQ (lines ()[1].at ("frame"), 0);
    EXPECT_EQ (lines ()[2].at ("frame"), 1);
    gst_element_set_state (harness_->element, GST_STATE_NULL);
    gst_element_set_state (harness_->element, GST_STATE_PLAYING);
    gst_harness_push_event (
        harness_.get (), gst_event_new_stream_start ("again"));
    gst_harness_set_src_caps_str (harness_.get (), kCaps);
    GstSegment segment;
    gst_segment_init (&segment, GST_FORMAT_TIME);
    gst_harness_push_event (harness_.get (), gst_event_new_segment (&segment));
  }
}

TEST_F (LogTest, ScheduleComesFirstAndOnce)
{
  const Schedule staircase = *Schedule::from_preset ("staircase:2x2");
  play (path_.get ());
  gst_harness_push_event (harness_.get (), schedule_to_event (staircase));
  ASSERT_EQ (push (frame (0)), GST_FLOW_OK);
  gst_harness_push_event (harness_.get (), schedule_to_event (staircase));
  ASSERT_EQ (push (frame (40 * GST_MSECOND)), GST_FLOW_OK);

  ASSERT_EQ (lines ().size (), 3u);
  const auto read_back = Schedule::from_json (lines ()[0].dump ());
  ASSERT_TRUE (read_back) << read_back.error ().message;
  EXPECT_EQ (*read_back, staircase);
}

TEST_F (LogTest, TheBenchProfileFollowsTheScheduleOnce)
{
  StreamSetup measured = {*Schedule::from_preset ("staircase:2x2")};
  measured.bench.emplace ().camera.size = {8, 8};
  play (path_.get ());
  for (int i = 0; i < 2; i++) {
    gst_harness_push_event (harness_.get (), setup_to_event (measured));
    ASSERT_EQ (push (frame (GstClockTime (i) * 33'366'666)), GST_FLOW_OK);
  }
  ASSERT_EQ (lines ().size (), 4u);
  EXPECT_EQ (lines ()[1], Json::parse (measured.bench->to_json ()));
}

TEST_F (LogTest, MappingFollowsTheSchedule)
{
  const StreamSetup mapped = {
      *Schedule::from_preset ("staircase:2x2"), Mapping (Extent{16, 8})};
  play (path_.get ());
  gst_harness_push_event (harness_.get (), schedule_to_event (mapped.schedule));
  for (int i = 0; i < 2; i++) {
    gst_harness_push_event (harness_.get (), setup_to_event (mapped));
    ASSERT_EQ (push (frame (GstClockTime (i) * 33'366'666)), GST_FLOW_OK);
  }
  ASSERT_EQ (lines ().size (), 4u);
  EXPECT_EQ (lines ()[0], Json::parse (mapped.schedule.to_json ()));
  EXPECT_EQ (lines ()[1], Json::parse (mapped.mapping->to_json ()));
}

TEST_F (LogTest, NewScheduleIsWrittenBeforeItsFrames)
{
  play (path_.get ());
  for (const char *preset : {"staircase:2x2", "sequential:lattice:8/3"}) {
    gst_harness_push_event (
        harness_.get (), schedule_to_event (*Schedule::from_preset (preset)));
    ASSERT_EQ (push (frame (0)), GST_FLOW_OK);
  }
  ASSERT_EQ (lines ().size (), 4u);
  EXPECT_EQ (lines ()[2].at ("tile"), "lattice:8/3");
}

/* So that a recording whose track is lost does not pass for one without. */
TEST_F (LogTest, TheTagSaysThatThereIsATrack)
{
  for (const bool track : {false, true}) {
    play (path_.get ());
    Harness lines (nullptr, gst_harness_teardown);
    if (track)
      lines.reset (
          gst_harness_new_with_element (harness_->element, nullptr, "track"));
    gst_harness_push_event (harness_.get (),
        schedule_to_event (*Schedule::from_preset ("staircase:2x2")));
    ASSERT_EQ (push (frame (0)), GST_FLOW_OK);

    const EventPtr tag (
        gst_pad_get_sticky_event (harness_->sinkpad, GST_EVENT_TAG, 0));
    ASSERT_TRUE (tag);
    GstTagList *tags = nullptr;
    gst_event_parse_tag (tag.get (), &tags);
    const auto setup = setup_from_tags (tags);
    ASSERT_TRUE (setup && *setup);
    EXPECT_EQ (setup->value ().track, track);
    EXPECT_EQ (setup->value ().schedule.text (), "staircase:2x2");
    if (!track)
      continue;
    const BufferPtr line (gst_harness_pull (lines.get ()));
    GstMapInfo map;
    ASSERT_TRUE (gst_buffer_map (line.get (), &map, GST_MAP_READ));
    const std::string text (
        reinterpret_cast<const char *> (map.data), map.size);
    gst_buffer_unmap (line.get (), &map);
    EXPECT_NE (text.find ("\"setup\""), std::string::npos);
    EXPECT_EQ (text.find ("\"track\""), std::string::npos) << text;
  }
}

/* A recording has the frames of one camera. */
TEST_F (LogTest, OfASecondCameraTheTagSaysNothing)
{
  play (path_.get ());
  StreamSetup setup;
  setup.partner = PartnerSetup{{64, 48}};
  gst_harness_push_event (harness_.get (), setup_to_event (setup));
  ASSERT_EQ (push (frame (0)), GST_FLOW_OK);
  const EventPtr tag (
      gst_pad_get_sticky_event (harness_->sinkpad, GST_EVENT_TAG, 0));
  ASSERT_TRUE (tag);
  const auto recorded = setup_from_tags (tags_of (tag.get ()));
  ASSERT_TRUE (recorded && *recorded);
  EXPECT_FALSE (recorded->value ().partner);
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

TEST_F (LogTest, LinesNameTheirSetupAndTheTagsHaveAll)
{
  play (path_.get ());
  const Harness track (
      gst_harness_new_with_element (harness_->element, nullptr, "track"),
      gst_harness_teardown);
  const std::vector setups = {long_setup (1), long_setup (2)};
  for (const StreamSetup &setup : setups) {
    gst_harness_push_event (harness_.get (), setup_to_event (setup));
    for (int i = 0; i < 4; i++)
      ASSERT_EQ (push (frame (GstClockTime (i) * 33'366'666)), GST_FLOW_OK);
  }
  for (int i = 0; i < 8; i++) {
    const BufferPtr line (gst_harness_pull (track.get ()));
    GstMapInfo map;
    ASSERT_TRUE (gst_buffer_map (line.get (), &map, GST_MAP_READ));
    const auto read = TrackLine::from_json (
        {reinterpret_cast<const char *> (map.data), map.size});
    gst_buffer_unmap (line.get (), &map);
    ASSERT_TRUE (read);
    const StreamSetup &setup = setups[i < 4 ? 0 : 1];
    EXPECT_EQ (read->setup_id, id_of (setup)) << i;
    EXPECT_EQ (read->setup.has_value (), i == 0 || i == 1 || i == 4) << i;
    if (read->setup) {
      EXPECT_EQ (*read->setup, setup);
    }
  }
  const EventPtr tag (
      gst_pad_get_sticky_event (harness_->sinkpad, GST_EVENT_TAG, 0));
  GstTagList *tags = nullptr;
  gst_event_parse_tag (tag.get (), &tags);
  EXPECT_EQ (setups_from_tags (tags), std::vector{setups[0]});
}

TEST_F (LogTest, FramesPassUntouched)
{
  play (path_.get ());
  BufferPtr buffer = frame (0);
  GstBuffer *const before = buffer.get ();
  ASSERT_EQ (push (std::move (buffer)), GST_FLOW_OK);
  const BufferPtr after (gst_harness_pull (harness_.get ()));
  EXPECT_EQ (after.get (), before);
}

TEST_F (LogTest, SecondRunStartsAnew)
{
  play (path_.get ());
  ASSERT_EQ (push (frame (0)), GST_FLOW_OK);
  ASSERT_EQ (push (frame (40 * GST_MSECOND)), GST_FLOW_OK);
  harness_.reset ();
  play (path_.get ());
  ASSERT_EQ (push (frame (0)), GST_FLOW_OK);
  ASSERT_EQ (lines ().size (), 1u);
  EXPECT_EQ (lines ()[0].at ("frame"), 0);
}

TEST_F (LogTest, FullDiskStopsTheStreamAndSaysSo)
{
  play ("/dev/full");
  const ObjectPtr<GstBus> bus (gst_bus_new ());
  gst_element_set_bus (harness_->element, bus.get ());
  EXPECT_EQ (push (frame (0)), GST_FLOW_ERROR);
  GstMessage *message = gst_bus_pop_filtered (bus.get (), GST_MESSAGE_ERROR);
  ASSERT_NE (message, nullptr);
  GError *error = nullptr;
  gst_message_parse_error (message, &error, nullptr);
  EXPECT_TRUE (g_error_matches (
      error, GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NO_SPACE_LEFT));
  EXPECT_NE (std::string (error->message).find ("/dev/full"), std::string::npos)
      << error->message;
  g_error_free (error);
  gst_message_unref (message);
  gst_element_set_bus (harness_->element, nullptr);
}

TEST_F (LogTest, SaysAtStartWhatItCannotWrite)
{
  using Failure = std::pair<GQuark, gint>;
  EXPECT_EQ (error_at_start (nullptr),
      Failure (GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NOT_FOUND));
  EXPECT_EQ (error_at_start ("/nonexistent/frames.jsonl"),
      Failure (GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_OPEN_WRITE));
  EXPECT_EQ (error_at_start (path_.get ()), Failure ());
}

} // namespace

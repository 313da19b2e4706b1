/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: the schedule and the method from its properties, and
 * pads that a schedule does not have. */
#include "demux_schedule.h"

#include <cstdio>
#include <fstream>

#include <glib/gstdio.h>

#include "common/tag.h"
#include "schedule_tags.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

TEST_F (DemuxSchedule, IsAssumedWithOneWarningWhereNothingIsSaid)
{
  start ("");
  demux->push_event (gst_event_new_tag (
      gst_tag_list_new (GST_TAG_COMMENT, "shot in the garden", nullptr)));
  ASSERT_EQ (push (0), GST_FLOW_OK);
  demux->set_caps (gray_caps (24, 24, "50/1"));
  ASSERT_EQ (push (1), GST_FLOW_OK);
  EXPECT_EQ (in_force (*demux), "sequential:2x2");
  EXPECT_NE (
      demux->warning ().find ("assuming sequential:2x2"), std::string::npos);
  EXPECT_EQ (demux->warning (), "");
}

TEST_F (DemuxSchedule, RankNeedsNoSchedule)
{
  start ("method=rank");
  ASSERT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (pull_images (*demux),
      expected ("sequential:2x2", picture (), Method::kRank));
  EXPECT_NE (demux->warning (), "");
}

TEST_F (DemuxSchedule, MayBeRequired)
{
  start ("require-schedule=true");
  EXPECT_EQ (push (0), GST_FLOW_NOT_NEGOTIATED);
  EXPECT_NE (demux->error ().find ("schedule property"), std::string::npos);
}

TEST_F (DemuxSchedule, MayBeAFile)
{
  gchar *name = nullptr;
  g_close (g_file_open_tmp ("demux_XXXXXX.json", &name, nullptr), nullptr);
  const CharPtr path (name);
  std::ofstream (name) << schedule_of ("sequential:3x2").to_json ();
  start (std::string ("schedule=") + name);
  ASSERT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (in_force (*demux), "sequential:3x2");

  /* The file is read at the start of a run. */
  gst_element_set_state (demux->element (), GST_STATE_NULL);
  std::ofstream (name) << schedule_of ("sequential:3x3").to_json ();
  gst_element_set_state (demux->element (), GST_STATE_PLAYING);
  demux->push_event (gst_event_new_stream_start ("again"));
  demux->set_caps (gray_caps (24, 24));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  demux->push_event (gst_event_new_segment (&segment));
  ASSERT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (in_force (*demux), "sequential:3x3");
  std::remove (name);
}

TEST_F (DemuxSchedule, PropertyThatCannotBeReadFailsTheStart)
{
  const ObjectPtr<GstElement> element (
      gst_element_factory_make ("codedexposure-demux", nullptr));
  gst_object_ref_sink (element.get ());
  g_object_set (element.get (), "schedule", "sequential:0x2", nullptr);
  const std::string text = refusal (element.get (), GST_STATE_READY);
  EXPECT_NE (text.find ("0x2"), std::string::npos) << text;

  g_object_set (element.get (), "schedule", "", nullptr);
  EXPECT_EQ (gst_element_set_state (element.get (), GST_STATE_READY),
      GST_STATE_CHANGE_SUCCESS);
  gst_element_set_state (element.get (), GST_STATE_NULL);
}

TEST_F (DemuxSchedule, PropertiesApplyAtTheNextFrame)
{
  start ("schedule=sequential:2x2");
  ASSERT_EQ (push (0), GST_FLOW_OK);
  pull_images (*demux);
  g_object_set (demux->element (), "schedule", "staircase:3x3", nullptr);
  EXPECT_EQ (in_force (*demux), "sequential:2x2");
  ASSERT_EQ (push (1), GST_FLOW_OK);
  EXPECT_EQ (in_force (*demux), "staircase:3x3");
  EXPECT_EQ (method_in_force (*demux), int (Method::kDecode));
  EXPECT_EQ (pull_images (*demux),
      expected ("staircase:3x3", picture (), Method::kDecode));
  gst_util_set_object_arg (G_OBJECT (demux->element ()), "method", "select");
  ASSERT_EQ (push (2), GST_FLOW_OK);
  EXPECT_EQ (pull_images (*demux),
      expected ("staircase:3x3", picture (), Method::kSelect));
}

TEST_F (DemuxSchedule, UnreadablePropertyMidStreamIsAnError)
{
  start ("schedule=sequential:2x2");
  ASSERT_EQ (push (0), GST_FLOW_OK);
  g_object_set (demux->element (), "schedule", "zigzag:2x2", nullptr);
  EXPECT_NE (push (1), GST_FLOW_OK);
  const std::string text = demux->error ();
  EXPECT_NE (text.find ("zigzag"), std::string::npos) << text;
}

TEST_F (DemuxSchedule, InForceIsNotifiedOnChangeOnly)
{
  start ("schedule=sequential:2x2");
  int times = 0;
  g_signal_connect_swapped (demux->element (), "notify::schedule-in-force",
      G_CALLBACK (+[] (int *count) { (*count)++; }), &times);
  for (int frame = 0; frame < 3; frame++)
    ASSERT_EQ (push (frame), GST_FLOW_OK);
  EXPECT_EQ (times, 1);
  demux->set_caps (gray_caps (24, 24, "50/1"));
  ASSERT_EQ (push (3), GST_FLOW_OK);
  EXPECT_EQ (times, 1);
  g_object_set (demux->element (), "schedule", "sequential:3x3", nullptr);
  ASSERT_EQ (push (4), GST_FLOW_OK);
  EXPECT_EQ (times, 2);
}

TEST_F (DemuxSchedule, MethodThatTheCodeDoesNotAllowIsAnError)
{
  start ("schedule=staircase:2x2 method=decode bits=9");
  EXPECT_NE (push (0), GST_FLOW_OK);
  EXPECT_NE (demux->error ().find ("9"), std::string::npos);
}

TEST_F (DemuxSchedule, PadBeyondTheScheduleIsAnErrorThatNamesTheRange)
{
  start ("");
  demux->request ("subframe_7");
  demux->push_event (schedule_to_event (schedule_of ("sequential:3x2")));
  EXPECT_NE (push (0), GST_FLOW_OK);
  const std::string text = demux->error ();
  EXPECT_NE (text.find ("subframe_7"), std::string::npos) << text;
  EXPECT_NE (text.find ("sequential:3x2"), std::string::npos) << text;
  EXPECT_NE (text.find ("subframe_5"), std::string::npos) << text;
}

TEST_F (DemuxSchedule, PadBeyondTheScheduleInForceIsRefused)
{
  start ("schedule=sequential:2x2");
  ASSERT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (gst_element_request_pad_simple (demux->element (), "subframe_4"),
      nullptr);
  const std::string text = demux->warning ();
  EXPECT_NE (text.find ("subframe_4"), std::string::npos) << text;
  EXPECT_NE (text.find ("subframe_3"), std::string::npos) << text;
  EXPECT_EQ (push (1), GST_FLOW_OK);
}

} // namespace

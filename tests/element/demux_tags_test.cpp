/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: what the tags of a stream say of its frames, and what
 * its own streams say. */
#include "demux_schedule.h"

#include "common/meta.h"
#include "common/tag.h"
#include "schedule_tags.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

/* -------------------------------------------------------------- schedule -- */

TEST_F (DemuxSchedule, ComesFromTheTagOfTheStream)
{
  start ("");
  ASSERT_TRUE (
      demux->push_event (schedule_to_event (schedule_of ("sequential:3x3"))));
  ASSERT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (in_force (*demux), "sequential:3x3");
  EXPECT_EQ (pull_images (*demux),
      expected ("sequential:3x3", picture (), Method::kSelect));
  EXPECT_EQ (demux->warning (), "");
}

TEST_F (DemuxSchedule, PropertyWinsOverTheTag)
{
  start ("schedule=sequential:2x2");
  demux->push_event (schedule_to_event (schedule_of ("sequential:3x3")));
  ASSERT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (in_force (*demux), "sequential:2x2");
  EXPECT_EQ (pull_images (*demux).size (), 4u);
  EXPECT_EQ (demux->warning (), "The schedule property (or --schedule), "
                                "sequential:2x2, overrides the schedule of the "
                                "stream, sequential:3x3.");
  demux->set_caps (gray_caps (24, 24, "50/1"));
  ASSERT_EQ (push (1), GST_FLOW_OK);
  EXPECT_EQ (demux->warning (), "") << "once";
}

TEST_F (DemuxSchedule, PropertyMakesAnUnreadableTagHarmless)
{
  start ("schedule=sequential:2x2");
  demux->push_event (gst_event_new_tag (
      gst_tag_list_new (GST_TAG_COMMENT, "coded-exposure={nonsense", nullptr)));
  EXPECT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (demux->error (), "");
}

TEST_F (DemuxSchedule, UnreadableTagIsAnErrorThatSaysWhy)
{
  start ("");
  demux->push_event (gst_event_new_tag (gst_tag_list_new (GST_TAG_COMMENT,
      "coded-exposure={\"format\":\"coded-exposure\",\"version\":77}",
      nullptr)));
  EXPECT_NE (push (0), GST_FLOW_OK);
  const std::string text = demux->error ();
  EXPECT_NE (text.find ("tag"), std::string::npos) << text;
  EXPECT_NE (text.find ("77"), std::string::npos) << text;
  EXPECT_FALSE (demux->pull ());
}

TEST_F (DemuxSchedule, TagThatComesLaterChangesTheNumberOfSubframes)
{
  start ("");
  ASSERT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (pull_images (*demux).size (), 4u);
  demux->push_event (
      schedule_to_event (schedule_of ("sequential:lattice:8/3")));
  ASSERT_EQ (push (1), GST_FLOW_OK);
  EXPECT_TRUE (same_caps (demux->pad_caps ().get (),
      "video/x-raw,format=GRAY8,width=3,height=24,framerate=200/1,"
      "pixel-aspect-ratio=8/1"));
  EXPECT_EQ (pull_images (*demux),
      expected ("sequential:lattice:8/3", picture (), Method::kSelect));
}

/* As in a recording without a track; the property wins. */
TEST (DemuxTagged, BitsOfTheTagCountWhereFramesHaveNoMeta)
{
  for (const auto &[settings, bits] : {std::pair ("", 12), {" bits=10", 10}}) {
    ElementHarness demux (std::string ("codedexposure-demux") + settings);
    demux.set_caps (gray_caps (8, 8, "25/1", "GRAY16_LE"));
    StreamSetup setup{schedule_of ("sequential:2x2")};
    setup.bits = 12;
    demux.push_event (setup_to_event (setup));
    ASSERT_EQ (
        demux.push (frame_of (
            draw<std::uint16_t> (8, 8, [] (int, int) { return 4095; }), 0)),
        GST_FLOW_OK);
    const BufferPtr out = demux.pull ();
    ASSERT_TRUE (out);
    const auto meta = get_frame_meta (out.get ());
    EXPECT_EQ (meta->bits, bits);
    EXPECT_EQ (meta->saturated, 64u);
    const EventPtr tag = demux.pull_event (GST_EVENT_TAG);
    ASSERT_TRUE (tag);
    int said = -1;
    follow_tagged_bits (tag.get (), said);
    EXPECT_EQ (said, bits);
  }
}

TEST_F (DemuxSchedule, TagOfAnotherStreamIsForgotten)
{
  start ("");
  demux->push_event (schedule_to_event (schedule_of ("sequential:3x3")));
  ASSERT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (demux->warning (), "");
  demux->push_event (gst_event_new_stream_start ("another"));
  demux->set_caps (gray_caps (24, 24));
  ASSERT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (in_force (*demux), "sequential:2x2");
  EXPECT_NE (demux->warning (), "");
}

TEST_F (DemuxSchedule, ANewOneInMidStreamIsSaidAndDiscontinuous)
{
  start ("");
  demux->push_event (schedule_to_event (schedule_of ("sequential:2x2")));
  ASSERT_EQ (push (0), GST_FLOW_OK);
  demux->push_event (schedule_to_event (schedule_of ("sequential:3x3")));
  while (demux->pull ()) {
  }
  ASSERT_EQ (push (1), GST_FLOW_OK);
  const BufferPtr first = demux->pull ();
  EXPECT_TRUE (GST_BUFFER_IS_DISCONT (first.get ()));
  EXPECT_EQ (demux->info (),
      "The schedule changes from sequential:2x2 to sequential:3x3 at "
      "0:00:00.040000000.");
}

TEST_F (DemuxSchedule, ANewOneBeforeAGapIsSaidWithoutATime)
{
  start ("");
  demux->push_event (schedule_to_event (schedule_of ("sequential:2x2")));
  ASSERT_EQ (push (0), GST_FLOW_OK);
  demux->push_event (schedule_to_event (schedule_of ("sequential:3x3")));
  demux->push_event (gst_event_new_gap (40 * GST_MSECOND, 40 * GST_MSECOND));
  EXPECT_EQ (demux->info (), "The schedule changes from sequential:2x2 to "
                             "sequential:3x3 with the next "
                             "coded frame.");
}

/* ----------------------------------------------------------- provenance -- */

TEST_F (DemuxSchedule, PicturesSayHowTheyWereMadeAndCodedFramesWhatTheyAre)
{
  start ("");
  demux->request ("subframe_0");
  demux->request ("coded");
  const Schedule schedule = schedule_of ("sequential:3x3");
  demux->push_event (
      setup_to_event ({.schedule = schedule, .simulated = true}));
  ASSERT_EQ (push (0), GST_FLOW_OK);
  for (const char *pad : {"", "subframe_0", "coded"}) {
    const EventPtr event = demux->pull_event (GST_EVENT_TAG, pad);
    ASSERT_TRUE (event) << pad;
    GstTagList *tags = nullptr;
    gst_event_parse_tag (event.get (), &tags);
    const auto found = schedule_from_tags (tags);
    const auto made = provenance_from_tags (tags);
    if (std::string (pad) == "coded") {
      ASSERT_TRUE (found && *found);
      EXPECT_EQ (found->value (), schedule);
      EXPECT_FALSE (made);
      continue;
    }
    EXPECT_FALSE (found) << pad;
    ASSERT_TRUE (made && *made) << pad;
    EXPECT_EQ (made->value ().setup.schedule, schedule);
    EXPECT_TRUE (made->value ().setup.simulated);
    EXPECT_EQ (made->value ().method, "select");
    EXPECT_EQ (made->value ().first_frame, 0u);
  }
}

TEST_F (DemuxSchedule, WhatWasDecodedIsRefused)
{
  start ("");
  demux->push_event (
      provenance_to_event ({{schedule_of ("staircase:2x2")}, "decode", 12, 0}));
  EXPECT_EQ (push (0), GST_FLOW_NOT_NEGOTIATED);
  EXPECT_NE (
      demux->error ().find ("staircase:2x2 by decode"), std::string::npos);
}

TEST_F (DemuxSchedule, FramesThatWereScaledOrTimedAnewAreRefused)
{
  StreamSetup setup{schedule_of ("sequential:2x2")};
  for (const char *wrong : {"size", "rate"}) {
    start ("");
    setup.size = Extent{24, 24};
    setup.rate = FrameRate{25, 1};
    if (wrong == std::string ("size"))
      setup.size->width = 48;
    else
      setup.rate->num = 30;
    demux->push_event (setup_to_event (setup));
    EXPECT_EQ (push (0), GST_FLOW_NOT_NEGOTIATED) << wrong;
    EXPECT_NE (demux->error ().find ("the camera gave"), std::string::npos);
  }
}

} // namespace

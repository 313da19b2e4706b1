/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: caps in both directions, frame rates that are missing,
 * and renegotiation. */
#include "harness.h"

#include "common/tag.h"
#include "schedule_tags.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;

template <typename Pixel = std::uint8_t>
BufferPtr
coded_frame (int width, int height, GstClockTime pts = 0)
{
  return frame_of (
      draw<Pixel> (width, height, [] (int x, int y) { return x + y; }), pts);
}

struct PadCapsCase {
  const char *rule;
  const char *settings;
  const char *in;
  const char *src, *subframe, *coded;
};

void
PrintTo (const PadCapsCase &c, std::ostream *os)
{
  *os << c.rule;
}

class DemuxPadCaps : public ::testing::TestWithParam<PadCapsCase>
{
};

#define GRAY8_FIELDS "video/x-raw,format=GRAY8,"
#define SQUARE ",pixel-aspect-ratio=1/1"

INSTANTIATE_TEST_SUITE_P (Caps, DemuxPadCaps,
    ::testing::Values (
        PadCapsCase{"reference bench", "schedule=sequential:2x2",
            GRAY8_FIELDS "width=768,height=576,framerate=25/1",
            GRAY8_FIELDS "width=384,height=288,framerate=100/1" SQUARE,
            GRAY8_FIELDS "width=384,height=288,framerate=25/1" SQUARE,
            GRAY8_FIELDS "width=768,height=576,framerate=25/1"},
        PadCapsCase{"16 bits at a rate that is no whole number",
            "schedule=sequential:3x3",
            "video/x-raw,format=GRAY16_LE,width=768,height=576,"
            "framerate=30000/1001,pixel-aspect-ratio=12/11",
            "video/x-raw,format=GRAY16_LE,width=256,height=192,"
            "framerate=270000/1001,pixel-aspect-ratio=12/11",
            "video/x-raw,format=GRAY16_LE,width=256,height=192,"
            "framerate=30000/1001,pixel-aspect-ratio=12/11",
            "video/x-raw,format=GRAY16_LE,width=768,height=576,"
            "framerate=30000/1001,pixel-aspect-ratio=12/11"},
        PadCapsCase{"columns and rows that fill no cell are cropped",
            "schedule=sequential:2x2",
            GRAY8_FIELDS "width=65,height=33,framerate=25/1",
            GRAY8_FIELDS "width=32,height=16,framerate=100/1" SQUARE,
            GRAY8_FIELDS "width=32,height=16,framerate=25/1" SQUARE,
            GRAY8_FIELDS "width=65,height=33,framerate=25/1"},
        PadCapsCase{"a cell that is not square changes the pixels' aspect",
            "schedule=sequential:4x2",
            GRAY8_FIELDS "width=64,height=32,framerate=25/1",
            GRAY8_FIELDS
            "width=16,height=16,framerate=200/1,pixel-aspect-ratio=2/1",
            GRAY8_FIELDS
            "width=16,height=16,framerate=25/1,pixel-aspect-ratio=2/1",
            GRAY8_FIELDS "width=64,height=32,framerate=25/1"},
        PadCapsCase{"a lattice has the squarest cell there is",
            "schedule=sequential:lattice:4/2",
            GRAY8_FIELDS "width=64,height=32,framerate=25/1",
            GRAY8_FIELDS "width=32,height=16,framerate=100/1" SQUARE,
            GRAY8_FIELDS "width=32,height=16,framerate=25/1" SQUARE,
            GRAY8_FIELDS "width=64,height=32,framerate=25/1"},
        PadCapsCase{"the pilot's rows are cropped",
            "schedule=\"sequential:2x2,pilot=8\"",
            GRAY8_FIELDS "width=64,height=32,framerate=25/1",
            GRAY8_FIELDS "width=32,height=12,framerate=100/1" SQUARE,
            GRAY8_FIELDS "width=32,height=12,framerate=25/1" SQUARE,
            GRAY8_FIELDS "width=64,height=32,framerate=25/1"},
        PadCapsCase{"the property fills in a rate of 0/1",
            "schedule=sequential:2x2 frame-rate=30000/1001",
            GRAY8_FIELDS "width=64,height=32,framerate=0/1",
            GRAY8_FIELDS "width=32,height=16,framerate=120000/1001" SQUARE,
            GRAY8_FIELDS "width=32,height=16,framerate=30000/1001" SQUARE,
            GRAY8_FIELDS "width=64,height=32,framerate=30000/1001"},
        PadCapsCase{"the property fills in a rate that is missing",
            "schedule=sequential:2x2 frame-rate=25/1",
            GRAY8_FIELDS "width=64,height=32",
            GRAY8_FIELDS "width=32,height=16,framerate=100/1" SQUARE,
            GRAY8_FIELDS "width=32,height=16,framerate=25/1" SQUARE,
            GRAY8_FIELDS "width=64,height=32,framerate=25/1"},
        PadCapsCase{"the property gives way to the caps",
            "schedule=sequential:2x2 frame-rate=50/1",
            GRAY8_FIELDS "width=64,height=32,framerate=25/1",
            GRAY8_FIELDS "width=32,height=16,framerate=100/1" SQUARE,
            GRAY8_FIELDS "width=32,height=16,framerate=25/1" SQUARE,
            GRAY8_FIELDS "width=64,height=32,framerate=25/1"},
        PadCapsCase{"fields that are none of its business stay",
            "schedule=sequential:2x2",
            GRAY8_FIELDS "width=64,height=32,framerate=25/1,"
                         "colorimetry=1:1:5:1,camera=left",
            GRAY8_FIELDS "width=32,height=16,framerate=100/1,"
                         "colorimetry=1:1:5:1,camera=left" SQUARE,
            GRAY8_FIELDS "width=32,height=16,framerate=25/1,"
                         "colorimetry=1:1:5:1,camera=left" SQUARE,
            GRAY8_FIELDS "width=64,height=32,framerate=25/1,"
                         "colorimetry=1:1:5:1,camera=left"}));

TEST_P (DemuxPadCaps, FollowFromInputAndSchedule)
{
  const PadCapsCase &c = GetParam ();
  ElementHarness demux (std::string ("codedexposure-demux ") + c.settings);
  demux.request ("subframe_0");
  demux.request ("coded");
  demux.set_caps (c.in);
  const GstVideoInfo info = info_of (caps_of (c.in).get ());
  const bool deep = GST_VIDEO_INFO_FORMAT (&info) != GST_VIDEO_FORMAT_GRAY8;
  ASSERT_EQ (
      demux.push (deep ? coded_frame<std::uint16_t> (info.width, info.height)
                       : coded_frame (info.width, info.height)),
      GST_FLOW_OK)
      << demux.error ();
  EXPECT_TRUE (same_caps (demux.pad_caps ().get (), c.src));
  EXPECT_TRUE (same_caps (demux.pad_caps ("subframe_0").get (), c.subframe));
  EXPECT_TRUE (same_caps (demux.pad_caps ("coded").get (), c.coded));
}

struct Refusal {
  const char *rule;
  const char *settings;
  const char *in;
  std::vector<std::string> said;
};

void
PrintTo (const Refusal &c, std::ostream *os)
{
  *os << c.rule;
}

class DemuxRefuses : public ::testing::TestWithParam<Refusal>
{
};

INSTANTIATE_TEST_SUITE_P (Caps, DemuxRefuses,
    ::testing::Values (Refusal{"missing frame rate", "schedule=sequential:2x2",
                           GRAY8_FIELDS "width=64,height=32", {"frame-rate"}},
        Refusal{"unknown frame rate", "schedule=sequential:2x2",
            GRAY8_FIELDS "width=64,height=32,framerate=0/1", {"frame-rate"}},
        Refusal{"interlaced frames", "schedule=sequential:2x2",
            GRAY8_FIELDS "width=64,height=32,framerate=25/1,"
                         "interlace-mode=interleaved",
            {"interlaced", "progressive"}},
        Refusal{"frame smaller than a cell", "schedule=sequential:9x9",
            GRAY8_FIELDS "width=8,height=32,framerate=25/1", {"8", "9"}},
        Refusal{"slots that do not fit the frame period",
            "schedule=\"sequential:2x2,active=9.8ms,switching=0.2ms\"",
            GRAY8_FIELDS "width=64,height=32,framerate=30/1",
            {"9.8ms", "33"}}));

TEST_P (DemuxRefuses, WithTheReasonOnTheBus)
{
  const Refusal &c = GetParam ();
  ElementHarness demux (std::string ("codedexposure-demux ") + c.settings);
  demux.set_caps (c.in);
  const GstVideoInfo info = info_of (caps_of (c.in).get ());
  EXPECT_EQ (demux.push (coded_frame (info.width, info.height)),
      GST_FLOW_NOT_NEGOTIATED);
  const std::string text = demux.error ();
  for (const std::string &word : c.said)
    EXPECT_NE (text.find (word), std::string::npos) << text;
  EXPECT_FALSE (demux.pull ());
}

TEST (DemuxCaps, RatePropertySetAfterTheRefusalLetsFramesPass)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  demux.set_caps (GRAY8_FIELDS "width=64,height=32");
  EXPECT_EQ (demux.push (coded_frame (64, 32)), GST_FLOW_NOT_NEGOTIATED);
  gst_util_set_object_arg (G_OBJECT (demux.element ()), "frame-rate", "25/1");
  EXPECT_EQ (demux.push (coded_frame (64, 32)), GST_FLOW_OK);
  EXPECT_TRUE (same_caps (demux.pad_caps ().get (),
      GRAY8_FIELDS "width=32,height=16,framerate=100/1" SQUARE));
}

/* ------------------------------------------------------------- queries -- */

struct QueryCase {
  const char *rule;
  const char *settings;
  const char *peer;
  const char *answer;
};

void
PrintTo (const QueryCase &c, std::ostream *os)
{
  *os << c.rule;
}

#define ANY_GRAY "video/x-raw,format={GRAY8,GRAY16_LE},"
#define ANY_SIZE "width=[1,2147483647],height=[1,2147483647]"
#define ANY_RATE "framerate=(fraction)[0/1,2147483647/1]"

/* Caps that the sink pad accepts, for caps that the peer of "src" accepts. */
class DemuxSinkQuery : public ::testing::TestWithParam<QueryCase>
{
};

INSTANTIATE_TEST_SUITE_P (Caps, DemuxSinkQuery,
    ::testing::Values (
        QueryCase{"fixed", "schedule=sequential:2x2",
            GRAY8_FIELDS "width=384,height=288,framerate=100/1",
            GRAY8_FIELDS "width=[768,769],height=[576,577],framerate=25/1"},
        QueryCase{"ranges", "schedule=sequential:2x2",
            GRAY8_FIELDS "width=[16,64],height=[16,32],framerate=[20/1,120/1]",
            GRAY8_FIELDS "width=[32,129],height=[32,65],framerate=[5/1,30/1]"},
        QueryCase{"lists", "schedule=sequential:2x2",
            GRAY8_FIELDS "width=32,height=16,framerate={100/1,120000/1001}",
            GRAY8_FIELDS
            "width=[64,65],height=[32,33],framerate={25/1,30000/1001}"},
        QueryCase{"no rate, no limit", "schedule=sequential:2x2",
            GRAY8_FIELDS "width=32,height=16",
            GRAY8_FIELDS "width=[64,65],height=[32,33]," ANY_RATE},
        QueryCase{"unknown rate", "schedule=sequential:2x2",
            GRAY8_FIELDS "width=32,height=16,framerate=0/1",
            GRAY8_FIELDS "width=[64,65],height=[32,33],framerate=0/1"},
        QueryCase{"anything", "schedule=sequential:2x2", "ANY",
            ANY_GRAY ANY_SIZE "," ANY_RATE},
        QueryCase{"format that is none of its own", "schedule=sequential:2x2",
            "video/x-raw,format=RGB", "EMPTY"},
        QueryCase{"no schedule yet: only the format binds", "",
            GRAY8_FIELDS "width=384,height=288,framerate=100/1",
            GRAY8_FIELDS ANY_SIZE "," ANY_RATE},
        QueryCase{"the property admits frames without a rate",
            "schedule=sequential:2x2 frame-rate=25/1",
            GRAY8_FIELDS "width=32,height=16,framerate=100/1",
            GRAY8_FIELDS
            "width=[64,65],height=[32,33],framerate=25/1;" GRAY8_FIELDS
            "width=[64,65],height=[32,33],framerate=0/1"},
        QueryCase{"the property helps no other rate",
            "schedule=sequential:2x2 frame-rate=50/1",
            GRAY8_FIELDS "width=32,height=16,framerate=100/1",
            GRAY8_FIELDS "width=[64,65],height=[32,33],framerate=25/1"}));

TEST_P (DemuxSinkQuery, AnswersForDownstream)
{
  const QueryCase &c = GetParam ();
  ElementHarness demux (std::string ("codedexposure-demux ") + c.settings);
  gst_harness_set_sink_caps (demux.get (), caps_of (c.peer).release ());
  const CapsPtr answer (
      gst_pad_peer_query_caps (demux.get ()->srcpad, nullptr));
  EXPECT_TRUE (same_caps (answer.get (), c.answer));
}

/* An assumed schedule must not reject caps that the schedule of a later tag
 * needs; a schedule from the stream is binding. */
TEST (DemuxCaps, QueryIsBoundByTheTagButNotByAnAssumption)
{
  ElementHarness demux ("codedexposure-demux");
  gst_harness_set_sink_caps_str (
      demux.get (), GRAY8_FIELDS "framerate={100/1,225/1}");
  demux.set_caps (gray_caps (18, 18));
  ASSERT_EQ (demux.push (coded_frame (18, 18)), GST_FLOW_OK);
  CapsPtr answer (gst_pad_peer_query_caps (demux.get ()->srcpad, nullptr));
  EXPECT_TRUE (same_caps (answer.get (), GRAY8_FIELDS ANY_SIZE "," ANY_RATE));

  demux.push_event (schedule_to_event (*Schedule::parse ("sequential:3x3")));
  ASSERT_EQ (demux.push (coded_frame (18, 18, kPeriod)), GST_FLOW_OK);
  answer.reset (gst_pad_peer_query_caps (demux.get ()->srcpad, nullptr));
  EXPECT_TRUE (same_caps (
      answer.get (), GRAY8_FIELDS ANY_SIZE ",framerate={100/9,25/1}"));
}

TEST (DemuxCaps, QueryKeepsTheOrderOfTheFilter)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  const CapsPtr filter =
      caps_of ("video/x-raw,format=GRAY16_LE;video/x-raw,format=GRAY8");
  const CapsPtr answer (
      gst_pad_peer_query_caps (demux.get ()->srcpad, filter.get ()));
  ASSERT_EQ (gst_caps_get_size (answer.get ()), 2u);
  EXPECT_STREQ (gst_structure_get_string (
                    gst_caps_get_structure (answer.get (), 0), "format"),
      "GRAY16_LE");
}

TEST (DemuxCaps, RequestPadBindsTheSinkOnlyWhenLinked)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  GstHarness *one = demux.request ("subframe_1");
  gst_harness_set_sink_caps_str (
      one, GRAY8_FIELDS "width=32,height=16,framerate=25/1");
  CapsPtr answer (gst_pad_peer_query_caps (demux.get ()->srcpad, nullptr));
  EXPECT_TRUE (same_caps (answer.get (),
      GRAY8_FIELDS "width=[64,65],height=[32,33],framerate=25/1"));

  GstHarness *coded = demux.request ("coded");
  gst_harness_set_sink_caps_str (coded, "video/x-raw,width=65");
  answer.reset (gst_pad_peer_query_caps (demux.get ()->srcpad, nullptr));
  EXPECT_TRUE (same_caps (
      answer.get (), GRAY8_FIELDS "width=65,height=[32,33],framerate=25/1"));

  GstPad *sink = GST_PAD (gst_object_ref (one->sinkpad));
  GstPad *src = gst_pad_get_peer (sink);
  gst_pad_unlink (src, sink);
  answer.reset (gst_pad_peer_query_caps (demux.get ()->srcpad, nullptr));
  EXPECT_TRUE (same_caps (
      answer.get (), ANY_GRAY "width=65,height=[1,2147483647]," ANY_RATE));
  gst_pad_link (src, sink);
  gst_object_unref (src);
  gst_object_unref (sink);
}

/* Caps that "src" can produce, for caps that the peer of the sink pad can
 * produce. */
class DemuxSrcQuery : public ::testing::TestWithParam<QueryCase>
{
};

INSTANTIATE_TEST_SUITE_P (Caps, DemuxSrcQuery,
    ::testing::Values (QueryCase{"fixed", "schedule=sequential:2x2",
                           GRAY8_FIELDS "width=769,height=577,framerate=25/1",
                           GRAY8_FIELDS "width=384,height=288,framerate=100/1"},
        QueryCase{"ranges and lists", "schedule=sequential:3x3",
            GRAY8_FIELDS "width=[1,32],height={3,5,6},framerate=[1/1,30/1]",
            GRAY8_FIELDS "width=[1,10],height={1,2},framerate=[9/1,270/1]"},
        QueryCase{"aspect", "schedule=sequential:4x2",
            GRAY8_FIELDS "width=64,height=32,framerate=25/1,"
                         "pixel-aspect-ratio=1/1",
            GRAY8_FIELDS "width=16,height=16,framerate=200/1,"
                         "pixel-aspect-ratio=2/1"},
        QueryCase{"unknown rate", "schedule=sequential:2x2",
            GRAY8_FIELDS "width=64,height=32,framerate=0/1",
            GRAY8_FIELDS "width=32,height=16,framerate=0/1"},
        QueryCase{"the property gives the rate",
            "schedule=sequential:2x2 frame-rate=30/1",
            GRAY8_FIELDS "width=64,height=32,framerate=0/1",
            GRAY8_FIELDS "width=32,height=16,framerate=120/1"},
        QueryCase{"no schedule yet: only the format binds", "",
            GRAY8_FIELDS "width=64,height=32,framerate=25/1",
            GRAY8_FIELDS ANY_SIZE "," ANY_RATE}));

TEST_P (DemuxSrcQuery, AnswersForUpstream)
{
  const QueryCase &c = GetParam ();
  ElementHarness demux (std::string ("codedexposure-demux ") + c.settings);
  ObjectPtr<GstPad> upstream (gst_pad_new ("upstream", GST_PAD_SRC));
  gst_object_ref_sink (upstream.get ());
  gst_pad_use_fixed_caps (upstream.get ());
  gst_pad_set_active (upstream.get (), TRUE);
  const ObjectPtr<GstPad> sink (
      gst_element_get_static_pad (demux.element (), "sink"));
  const ObjectPtr<GstPad> harness (gst_pad_get_peer (sink.get ()));
  gst_pad_unlink (harness.get (), sink.get ());
  static CapsPtr offered;
  offered = caps_of (c.peer);
  gst_pad_set_query_function (
      upstream.get (), [] (GstPad *, GstObject *, GstQuery *query) -> gboolean {
        if (GST_QUERY_TYPE (query) != GST_QUERY_CAPS)
          return FALSE;
        gst_query_set_caps_result (query, offered.get ());
        return TRUE;
      });
  ASSERT_EQ (gst_pad_link_full (
                 upstream.get (), sink.get (), GST_PAD_LINK_CHECK_NOTHING),
      GST_PAD_LINK_OK);

  const CapsPtr answer (
      gst_pad_peer_query_caps (demux.get ()->sinkpad, nullptr));
  EXPECT_TRUE (same_caps (answer.get (), c.answer));
  gst_pad_unlink (upstream.get (), sink.get ());
  gst_pad_link (harness.get (), sink.get ());
  offered.reset ();
}

TEST (DemuxCaps, AcceptsFramesWithoutARateButNoOtherFormat)
{
  ElementHarness demux ("codedexposure-demux");
  const auto accepts = [&] (const char *caps) {
    return gst_pad_peer_query_accept_caps (
        demux.get ()->srcpad, caps_of (caps).get ());
  };
  EXPECT_TRUE (accepts (GRAY8_FIELDS "width=64,height=32,framerate=25/1"));
  EXPECT_TRUE (accepts (GRAY8_FIELDS "width=64,height=32"));
  EXPECT_TRUE (accepts (GRAY8_FIELDS "width=64,height=32,framerate=0/1"));
  EXPECT_FALSE (
      accepts ("video/x-raw,format=RGB,width=64,height=32,framerate=25/1"));
}

/* -------------------------------------------------------- renegotiation -- */

TEST (DemuxCaps, SizeRateAndFormatMayChangeMidStream)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  demux.request ("subframe_0");
  demux.set_caps (gray_caps (16, 8));
  ASSERT_EQ (demux.push (coded_frame (16, 8)), GST_FLOW_OK);
  while (demux.pull ())
    ;

  const Image<std::uint16_t> picture =
      draw<std::uint16_t> (32, 16, [] (int x, int y) { return 999 * x + y; });
  demux.set_caps (gray_caps (32, 16, "30000/1001", "GRAY16_LE"));
  ASSERT_EQ (demux.push (frame_of (picture, kPeriod)), GST_FLOW_OK);
  EXPECT_TRUE (same_caps (demux.pad_caps ().get (),
      "video/x-raw,format=GRAY16_LE,width=16,height=8,"
      "framerate=120000/1001" SQUARE));
  EXPECT_TRUE (same_caps (demux.pad_caps ("subframe_0").get (),
      "video/x-raw,format=GRAY16_LE,width=16,height=8,"
      "framerate=30000/1001" SQUARE));

  const CapsPtr caps = demux.pad_caps ();
  for (int k = 0; k < 4; k++) {
    const BufferPtr sub = demux.pull ();
    ASSERT_TRUE (sub);
    EXPECT_EQ (image_of<std::uint16_t> (sub.get (), caps.get ()),
        draw<std::uint16_t> (16, 8, [&] (int x, int y) {
          return picture.at (2 * x + k % 2, 2 * y + k / 2);
        }));
  }
}

TEST (DemuxCaps, CapsThatDoNotChangeAreNotSentAgain)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  demux.set_caps (gray_caps (16, 8));
  ASSERT_EQ (demux.push (coded_frame (16, 8)), GST_FLOW_OK);
  ASSERT_TRUE (demux.pull_event (GST_EVENT_CAPS));
  ASSERT_TRUE (demux.push_event (
      gst_event_new_caps (caps_of (gray_caps (16, 8)).get ())));
  g_object_set (demux.element (), "gain", 2.0, nullptr);
  ASSERT_EQ (demux.push (coded_frame (16, 8, kPeriod)), GST_FLOW_OK);
  EXPECT_FALSE (demux.pull_event (GST_EVENT_CAPS));
}

TEST (DemuxCaps, CapsEventsBearTheSequenceNumberOfUpstream)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  demux.request ("coded");
  demux.set_caps (gray_caps (16, 8));
  GstEvent *event = gst_event_new_caps (caps_of (gray_caps (32, 16)).get ());
  const guint32 number = gst_event_get_seqnum (event);
  ASSERT_TRUE (demux.push_event (event));
  ASSERT_EQ (demux.push (coded_frame (32, 16)), GST_FLOW_OK);
  for (const char *pad : {"", "coded"}) {
    const EventPtr caps = demux.pull_event (GST_EVENT_CAPS, pad);
    ASSERT_TRUE (caps);
    EXPECT_EQ (gst_event_get_seqnum (caps.get ()), number);
  }
}

/* Tags follow caps, so source pads send caps with the first frame; events in
 * between must still follow the caps. */
TEST (DemuxCaps, EventsComeInTheOrderThatDownstreamNeeds)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  demux.set_caps (gray_caps (16, 8));
  demux.push_event (
      gst_event_new_tag (gst_tag_list_new (GST_TAG_TITLE, "a title", nullptr)));
  ASSERT_EQ (demux.push (coded_frame (16, 8)), GST_FLOW_OK);
  std::vector<GstEventType> order;
  while (GstEvent *event = gst_harness_try_pull_event (demux.get ())) {
    const EventPtr owned (event);
    order.push_back (GST_EVENT_TYPE (event));
  }
  EXPECT_EQ (order, (std::vector<GstEventType>{GST_EVENT_STREAM_START,
                        GST_EVENT_CAPS, GST_EVENT_SEGMENT, GST_EVENT_TAG}));
}

TEST (DemuxCaps, ASegmentWithoutFramesIsThereBeforeItIsDone)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  demux.set_caps (gray_caps (16, 8));
  demux.push_event (gst_event_new_segment_done (GST_FORMAT_TIME, 0));
  EXPECT_TRUE (demux.pull_event (GST_EVENT_SEGMENT));
  EXPECT_TRUE (demux.pull_event (GST_EVENT_SEGMENT_DONE));
}

} // namespace

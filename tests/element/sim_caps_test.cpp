/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-sim: caps, frame rates, and errors of what does not fit. */
#include "sim_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

struct Ask {
  const char *rule;
  const char *there; ///< caps on the other side of the element
  const char *here;
};

void
PrintTo (const Ask &ask, std::ostream *os)
{
  *os << ask.rule;
}

std::string
fields (const std::string &rate)
{
  return "video/x-raw,format=GRAY8,width=8,height=6,framerate=" + rate;
}

class SimSinkCaps : public ::testing::TestWithParam<Ask>
{
};

TEST_P (SimSinkCaps, FollowThoseOfDownstream)
{
  SimHarness sim ("schedule=sequential:2x2");
  gst_harness_set_sink_caps_str (
      sim.get (), fields (GetParam ().there).c_str ());
  const CapsPtr caps (gst_pad_peer_query_caps (sim.get ()->srcpad, nullptr));
  EXPECT_TRUE (same_caps (caps.get (), fields (GetParam ().here)));
}

INSTANTIATE_TEST_SUITE_P (Rates, SimSinkCaps,
    ::testing::Values (Ask{"fixed: that times the slots, or more", "25/1",
                           "[100/1,2147483647/1]"},
        Ask{"odd", "30000/1001", "[120000/1001,2147483647/1]"},
        Ask{"range", "[10/1,30/1]", "[40/1,2147483647/1]"},
        Ask{"list", "{(fraction)25/1,(fraction)15/1}", "[60/1,2147483647/1]"},
        Ask{"everything", "[0/1,2147483647/1]", "[0/1,2147483647/1]"}));

class SimSrcCaps : public ::testing::TestWithParam<Ask>
{
};

TEST_P (SimSrcCaps, FollowThoseOfUpstream)
{
  SimHarness sim ("schedule=sequential:2x2");
  const CapsPtr upstream = caps_of (fields (GetParam ().there));
  GstBaseTransformClass *klass = GST_BASE_TRANSFORM_GET_CLASS (sim.element ());
  const CapsPtr caps (
      klass->transform_caps (GST_BASE_TRANSFORM (sim.element ()), GST_PAD_SINK,
          upstream.get (), nullptr));
  EXPECT_TRUE (same_caps (caps.get (), fields (GetParam ().here)));
}

INSTANTIATE_TEST_SUITE_P (Rates, SimSrcCaps,
    ::testing::Values (
        Ask{"fixed: up to one of the slots", "100/1", "[0/1,25/1]"},
        Ask{"odd", "120000/1001", "[0/1,30000/1001]"},
        Ask{"range", "[40/1,200/1]", "[0/1,50/1]"},
        Ask{"list", "{(fraction)100/1,(fraction)200/1}", "[0/1,50/1]"},
        Ask{"unknown", "0/1", "0/1"}));

struct Negotiation {
  const char *in, *downstream, *out;
};

class SimRate : public ::testing::TestWithParam<Negotiation>
{
};

TEST_P (SimRate, IsTheLargestThatDownstreamTakes)
{
  SimHarness sim ("schedule=sequential:2x2");
  if (*GetParam ().downstream)
    gst_harness_set_sink_caps_str (
        sim.get (), fields (GetParam ().downstream).c_str ());
  sim.set_caps (fields (GetParam ().in));
  EXPECT_TRUE (same_caps (sim.pad_caps ().get (), fields (GetParam ().out)));
}

INSTANTIATE_TEST_SUITE_P (Rates, SimRate,
    ::testing::Values (Negotiation{"100/1", "", "25/1"},
        Negotiation{"30/1", "", "15/2"},
        Negotiation{"120000/1001", "", "30000/1001"},
        Negotiation{"200/1", "25/1", "25/1"},
        Negotiation{"300/1", "25/1", "25/1"},
        Negotiation{"240000/1001", "30000/1001", "30000/1001"},
        Negotiation{"200/1", "[1/1,30/1]", "25/1"}));

/* The error for a frame and an element with @properties. */
std::string
complaint (const std::string &properties, const std::string &caps,
    const std::string &downstream = "")
{
  SimHarness sim (properties);
  if (!downstream.empty ())
    gst_harness_set_sink_caps_str (sim.get (), downstream.c_str ());
  sim.set_caps (caps);
  EXPECT_LT (
      sim.push (frame_of (flat<std::uint8_t> (8, 6, 0), 0)), GST_FLOW_OK);
  const std::string error = sim.error ();
  EXPECT_EQ (sim.error (), "") << "said once";
  return error;
}

TEST (SimError, SaysWhichRateDoesNotFit)
{
  EXPECT_EQ (complaint ("", fields ("200/1"), fields ("30/1")),
      "200/1 input frames/s do not fill the 4 slots of 'sequential:2x2' evenly "
      "at 30/1 coded frames/s; ask for 50/1 coded frames/s or a whole fraction "
      "of it, or change the input's rate with videorate.");
}

TEST (SimError, SaysWhatDownstreamWantsInVain)
{
  const std::string error = complaint ("", fields ("100/1"), fields ("30/1"));
  EXPECT_NE (error.find ("(fraction)30/1\", but"), std::string::npos) << error;
  EXPECT_NE (error.find ("[ 0/1, 25/1 ]"), std::string::npos) << error;
}

TEST (SimError, SaysThatARateIsMissing)
{
  const std::string expected =
      "The input has no frame rate, and an exposure cannot be cut into slots "
      "without; put 'videorate ! video/x-raw,framerate=100/1' before "
      "codedexposure-sim.";
  EXPECT_EQ (complaint ("", fields ("0/1")), expected);
  EXPECT_EQ (
      complaint ("", "video/x-raw,format=GRAY8,width=8,height=6"), expected);
}

TEST (SimError, SaysThatTheSlotsDoNotFit)
{
  const std::string error =
      complaint ("schedule=sequential:2x2,active=12ms", fields ("100/1"));
  EXPECT_NE (error.find ("'sequential:2x2,active=12ms' cannot be shown"),
      std::string::npos);
  EXPECT_NE (error.find ("need 48ms"), std::string::npos) << error;
}

TEST (SimError, SaysWhatIsWrongWithASetting)
{
  EXPECT_EQ (complaint ("bits=12", fields ("100/1")),
      "bits = 12 is more than the 8 bits of GRAY8; set fewer, or 0 for all.");
  EXPECT_NE (
      complaint ("read-noise=5", fields ("100/1")).find ("needs a full well"),
      std::string::npos);
}

TEST (SimError, RefusesToStartWithWhatItCannotRead)
{
  for (const auto &[properties, words] :
      {std::pair ("schedule=nonsense:2x2", "nonsense"),
          std::pair ("schedule=/does/not/exist.json", "/does/not/exist.json"),
          std::pair ("dmd=dlpc350", "dmd 'dlpc350' is no simulated DMD"),
          std::pair ("dmd=sim:", "write sim:NAME"),
          std::pair ("schedule=staircase:2x2 beam=off",
              "beam=off: element 3 of code 'staircase' is on in every slot")}) {
    SCOPED_TRACE (properties);
    const ObjectPtr<GstElement> element (
        GST_ELEMENT (gst_object_ref_sink (gst_parse_launch (
            ("codedexposure-sim " + std::string (properties)).c_str (),
            nullptr))));
    const std::string text = refusal (element.get (), GST_STATE_PAUSED);
    EXPECT_NE (text.find (words), std::string::npos) << text;
    gst_element_set_state (element.get (), GST_STATE_NULL);
  }
}

TEST (SimError, AnExposureEndsAtAFrameThatCannotBeRead)
{
  SimHarness sim ("schedule=sequential:2x2");
  sim.start (8, 6);
  const auto push = [&] (int frame, int height) {
    return sim.push (frame_of (
        flat<std::uint8_t> (8, height, 100), GstClockTime (frame) * 10 * kMs));
  };
  for (int frame = 0; frame < 3; frame++)
    ASSERT_EQ (push (frame, 6), GST_FLOW_OK);
  EXPECT_EQ (push (3, 5), GST_FLOW_ERROR);
  EXPECT_EQ (property<guint64> (sim.element (), "frames-dropped"), 1u);
  for (int frame = 4; frame < 8; frame++)
    ASSERT_EQ (push (frame, 6), GST_FLOW_OK);
  const BufferPtr coded = sim.pull ();
  ASSERT_TRUE (coded);
  EXPECT_EQ (GST_BUFFER_PTS (coded.get ()), 40 * kMs);
  EXPECT_FALSE (sim.pull ());
}

TEST (SimError, ABufferThatIsTooSmallIsSaid)
{
  SimHarness sim;
  sim.start (8, 6);
  BufferPtr buffer (gst_buffer_new_allocate (nullptr, 10, nullptr));
  GST_BUFFER_PTS (buffer.get ()) = 0;
  EXPECT_EQ (sim.push (std::move (buffer)), GST_FLOW_ERROR);
  EXPECT_EQ (sim.error (),
      "A buffer of 10 bytes cannot hold the 8x6 GRAY8 pixels of its caps: they "
      "take 48 bytes. Correct the caps, or the element that made the buffer.");
}

TEST (SimAllocation, UpstreamMaySendVideoMeta)
{
  SimHarness sim;
  sim.start (8, 6);
  const CapsPtr caps (gst_pad_get_current_caps (sim.get ()->srcpad));
  const QueryPtr query (gst_query_new_allocation (caps.get (), TRUE));
  ASSERT_TRUE (gst_pad_peer_query (sim.get ()->srcpad, query.get ()));
  EXPECT_TRUE (gst_query_find_allocation_meta (
      query.get (), GST_VIDEO_META_API_TYPE, nullptr));
}

} // namespace

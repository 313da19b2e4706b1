/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-sum: the whole light of both beams. */
#include <string>

#include "common/meta.h"
#include "common/partner.h"
#include "common/tag.h"
#include "pipeline.h"
#include "two_beams.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;
using namespace codedexposure::test::two_beams;

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
const Schedule kSchedule = schedule_of (kPreset);

class Sum : public ::testing::Test
{
protected:
  Sum () : sum ("codedexposure-sum")
  {
    sum.set_caps (gray_caps (kWidth, kHeight));
    setup.schedule = kSchedule;
    setup.partner = PartnerSetup{{kWidth, kHeight}};
    const Pictures slots = truth (3, kSchedule.slots (), 0.8);
    on = coded (kSchedule, slots);
    off = coded (kSchedule.complement ().value (), slots);
  }
  void tell () { gst_harness_push_event (sum.get (), setup_to_event (setup)); }
  BufferPtr pair (int i, bool alone = false) const
  {
    BufferPtr frame = frame_of (on[std::size_t (i)], i * kPeriod);
    GST_BUFFER_DURATION (frame.get ()) = kPeriod;
    if (!alone)
      set_partner (
          frame.get (), {frame_of (off[std::size_t (i)], i * kPeriod),
                            CapsPtr (gst_caps_from_string (
                                gray_caps (kWidth, kHeight).c_str ()))});
    return frame;
  }

  ElementHarness sum;
  StreamSetup setup;
  Pictures on, off;
};

TEST_F (Sum, IsOfEachPairAtItsTime)
{
  tell ();
  for (int i = 0; i < 3; i++)
    ASSERT_EQ (sum.push (pair (i)), GST_FLOW_OK);
  const CapsPtr caps (
      gst_caps_from_string (gray_caps (kWidth, kHeight).c_str ()));
  for (int i = 0; i < 3; i++) {
    const BufferPtr made (gst_harness_pull (sum.get ()));
    EXPECT_EQ (GST_BUFFER_PTS (made.get ()), i * kPeriod);
    EXPECT_EQ (GST_BUFFER_DURATION (made.get ()), kPeriod);
    EXPECT_FALSE (get_partner (made.get ()));
    const auto meta = get_frame_meta (made.get ());
    ASSERT_TRUE (meta);
    EXPECT_EQ (meta->subframe, -1);
    EXPECT_EQ (meta->exposure_start, i * kPeriod);
    EXPECT_EQ (meta->exposure_duration, kPeriod);
    const auto picture = image_of<std::uint8_t> (made.get (), caps.get ());
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++) {
        double light = 0.0;
        for (int s = 0; s < 4; s++)
          light += scene (4 * i + s, 0.8).at (x, y) / 4.0;
        EXPECT_NEAR (picture.at (x, y), light, 2.0) << x << "," << y;
      }
  }
  EXPECT_NEAR (
      property<double> (sum.element (), "measured-ratio"), 1.0 / 3.0, 0.005);
}

TEST_F (Sum, TheRatioMayBeSetWhileItPlays)
{
  tell ();
  ASSERT_EQ (sum.push (pair (0)), GST_FLOW_OK);
  g_object_set (sum.element (), "ratio", 0.5, nullptr);
  ASSERT_EQ (sum.push (pair (1)), GST_FLOW_OK);
  EXPECT_EQ (property<double> (sum.element (), "measured-ratio"), 0.5);
  g_object_set (sum.element (), "ratio", 0.0, nullptr);
  ASSERT_EQ (sum.push (pair (2)), GST_FLOW_OK);
  EXPECT_NEAR (
      property<double> (sum.element (), "measured-ratio"), 1.0 / 3.0, 0.005);
}

/* A mapping that changes nothing. */
TEST_F (Sum, ASecondCameraWithAMappingIsResampled)
{
  const CapsPtr caps (
      gst_caps_from_string (gray_caps (kWidth, kHeight).c_str ()));
  tell ();
  ASSERT_EQ (sum.push (pair (0)), GST_FLOW_OK);
  setup.partner->mapping = Mapping (Extent{kWidth, kHeight});
  tell ();
  ASSERT_EQ (sum.push (pair (0)), GST_FLOW_OK);
  const BufferPtr plain (gst_harness_pull (sum.get ()));
  const BufferPtr mapped (gst_harness_pull (sum.get ()));
  EXPECT_TRUE (image_of<std::uint8_t> (plain.get (), caps.get ()) ==
               image_of<std::uint8_t> (mapped.get (), caps.get ()));

  setup.partner->mapping = Mapping (Extent{kWidth, kHeight + 8});
  tell ();
  EXPECT_NE (sum.push (pair (1)), GST_FLOW_OK);
  EXPECT_NE (
      sum.error ().find ("another number of mirrors"), std::string::npos);
}

TEST_F (Sum, OfAFrameAloneIsAGap)
{
  tell ();
  ASSERT_EQ (sum.push (pair (0)), GST_FLOW_OK);
  ASSERT_EQ (sum.push (pair (1, true)), GST_FLOW_OK);
  ASSERT_EQ (sum.push (pair (2)), GST_FLOW_OK);
  EXPECT_EQ (gst_harness_buffers_received (sum.get ()), 2u);
  EXPECT_EQ (property<guint64> (sum.element (), "frames-alone"), 1u);
  bool gap = false;
  while (const EventPtr event{gst_harness_try_pull_event (sum.get ())}) {
    if (GST_EVENT_TYPE (event.get ()) != GST_EVENT_GAP)
      continue;
    GstClockTime pts, duration;
    gst_event_parse_gap (event.get (), &pts, &duration);
    EXPECT_EQ (pts, kPeriod);
    EXPECT_EQ (duration, kPeriod);
    gap = true;
  }
  EXPECT_TRUE (gap);
  for (const bool discont : {true, true}) {
    const BufferPtr made (gst_harness_pull (sum.get ()));
    EXPECT_EQ (
        GST_BUFFER_FLAG_IS_SET (made.get (), GST_BUFFER_FLAG_DISCONT), discont);
  }
}

TEST_F (Sum, FramesAloneCanBeReadUntilTheNextRunStarts)
{
  tell ();
  ASSERT_EQ (sum.push (pair (0, true)), GST_FLOW_OK);
  gst_element_set_state (sum.element (), GST_STATE_READY);
  EXPECT_EQ (property<guint64> (sum.element (), "frames-alone"), 1u);
  gst_element_set_state (sum.element (), GST_STATE_PAUSED);
  EXPECT_EQ (property<guint64> (sum.element (), "frames-alone"), 0u);
}

TEST_F (Sum, WithoutASecondCameraSaysWhatIsMissing)
{
  setup.partner.reset ();
  tell ();
  EXPECT_NE (sum.push (pair (0)), GST_FLOW_OK);
  EXPECT_NE (
      sum.error ().find ("put codedexposure-pair before"), std::string::npos);
}

TEST_F (Sum, OfAnotherSizeNeedsAMapping)
{
  setup.partner->size = {kWidth, kHeight + 1};
  tell ();
  EXPECT_NE (sum.push (pair (0)), GST_FLOW_OK);
  EXPECT_NE (
      sum.error ().find ("calibrate the second camera"), std::string::npos);
}

TEST_F (Sum, APartnerOfAnotherFormatIsAnErrorThatNamesBoth)
{
  tell ();
  BufferPtr frame = pair (0, true);
  const BufferPtr wide (
      gst_buffer_new_allocate (nullptr, 2 * gsize (kWidth) * kHeight, nullptr));
  set_partner (frame.get (),
      {BufferPtr (gst_buffer_ref (wide.get ())),
          caps_of (gray_caps (kWidth, kHeight, "25/1", "GRAY16_LE"))});
  EXPECT_EQ (sum.push (std::move (frame)), GST_FLOW_ERROR);
  EXPECT_EQ (sum.error (),
      "A coded frame could not be decoded: it is GRAY8, but the frame of the "
      "second camera is GRAY16_LE; set both cameras to the same pixel format.");
}

TEST_F (Sum, APartnerOfAnotherSizeThanTheTagSaysIsAnError)
{
  tell ();
  BufferPtr frame = pair (0, true);
  set_partner (frame.get (), {frame_of (Image<std::uint8_t> (kWidth, 40), 0),
                                 caps_of (gray_caps (kWidth, 40))});
  EXPECT_EQ (sum.push (std::move (frame)), GST_FLOW_ERROR);
  EXPECT_NE (sum.error ().find ("64x40 pixels, but the stream tag says 64x48"),
      std::string::npos);
}

TEST_F (Sum, AMappingForFramesOfAnotherSizeIsAnError)
{
  setup.partner->size = {kWidth / 2, kHeight};
  setup.partner->mapping = Mapping (Extent{kWidth, kHeight});
  tell ();
  EXPECT_NE (sum.push (pair (0)), GST_FLOW_OK);
  EXPECT_NE (sum.error ().find ("their mapping is for frames of 64x48 pixels, "
                                "but they have 32x48"),
      std::string::npos);
}

/* Of both depths, and beside subframes of the first camera. */
TEST (SumBench, RunsBesideSubframes)
{
  for (const char *format : {"GRAY8", "GRAY16_LE"}) {
    Pipeline pipeline (
        std::string ("videotestsrc num-buffers=40 pattern=ball "
                     "! video/x-raw,format=") +
        format +
        ",width=64,height=48,framerate=100/1 ! tee name=light "
        "light. ! queue ! codedexposure-sim schedule=sequential:lattice:4/2 "
        "! pair.on light. ! queue ! codedexposure-sim "
        "schedule=sequential:lattice:4/2 beam=off ! pair.off "
        "codedexposure-pair name=pair ! tee name=pairs "
        "pairs. ! queue ! codedexposure-sum name=sum ! "
        "video/x-raw,framerate=25/1"
        ",width=64,height=48 ! fakesink name=whole "
        "pairs. ! queue ! codedexposure-demux ! fakesink name=parts");
    EXPECT_EQ (pipeline.play (), "");
    EXPECT_EQ (property<guint64> (pipeline["sum"].get (), "frames-alone"), 0u);
  }
}

/* As with a live source, whose second camera may come later. */
TEST (SumBench, ASecondCameraThatHasSentNothingIsNoError)
{
  const std::string video =
      " ! video/x-raw,format=GRAY8,width=64,height=48,framerate=100/1 "
      "! codedexposure-sim schedule=sequential:lattice:4/2";
  Pipeline pipeline ("videotestsrc num-buffers=40" + video +
                     " ! pair.on videotestsrc num-buffers=0" + video +
                     " beam=off ! pair.off codedexposure-pair name=pair "
                     "! codedexposure-sum name=sum ! fakesink");
  EXPECT_EQ (pipeline.play (), "");
  EXPECT_EQ (property<guint64> (pipeline["sum"].get (), "frames-alone"), 10u);
}

} // namespace

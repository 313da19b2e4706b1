/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: sources of the schedule, and pixel values of the
 * subframes. */
#include "harness.h"

#include <cstdio>
#include <fstream>

#include <glib/gstdio.h>

#include "common/messages.h"
#include "common/meta.h"
#include "common/tag.h"
#include "extract/extractor.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;

/* Every pixel encodes its position. */
template <typename Pixel = std::uint8_t>
Image<Pixel>
picture (int width = 24, int height = 24)
{
  return draw<Pixel> (width, height, [] (int x, int y) {
    return sizeof (Pixel) == 1 ? (7 * x + 31 * y) % 251 : 2621 * x + 41 * y;
  });
}

Schedule
schedule_of (const std::string &preset)
{
  auto schedule = Schedule::from_preset (preset);
  EXPECT_TRUE (schedule) << preset;
  return *schedule;
}

template <typename Pixel>
std::vector<Image<Pixel>>
expected (const std::string &preset, const Image<Pixel> &coded, Method method)
{
  const auto extractor = Extractor<Pixel>::make (
      schedule_of (preset), coded.width (), coded.height (), {method});
  EXPECT_TRUE (extractor) << extractor.error ().message;
  std::vector<Image<Pixel>> subframes (std::size_t (extractor->subframes ()),
      Image<Pixel> (extractor->subframe_size ().width,
          extractor->subframe_size ().height));
  std::vector<ImageView<Pixel>> views;
  for (auto &subframe : subframes)
    views.push_back (subframe.view ());
  EXPECT_TRUE (extractor->run (coded.view (), views));
  return subframes;
}

template <typename Pixel = std::uint8_t>
std::vector<Image<Pixel>>
pull_images (ElementHarness &demux)
{
  std::vector<Image<Pixel>> images;
  const CapsPtr caps = demux.pad_caps ();
  while (const BufferPtr buffer = demux.pull ())
    images.push_back (image_of<Pixel> (buffer.get (), caps.get ()));
  return images;
}

std::string
in_force (ElementHarness &demux)
{
  return text_property (demux.element (), "schedule-in-force");
}

int
method_in_force (ElementHarness &demux)
{
  return property<int> (demux.element (), "method-in-force");
}

class DemuxSchedule : public ::testing::Test
{
protected:
  void start (const std::string &settings)
  {
    demux =
        std::make_unique<ElementHarness> ("codedexposure-demux " + settings);
    demux->set_caps (gray_caps (24, 24));
  }
  GstFlowReturn push (int frame)
  {
    return demux->push (frame_of (picture (), GstClockTime (frame) * kPeriod));
  }
  std::unique_ptr<ElementHarness> demux;
};

/* -------------------------------------------------------------- sources -- */

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
  EXPECT_EQ (demux->info (),
      "The schedule property, sequential:2x2, overrides the schedule of the "
      "stream, sequential:3x3.");
  demux->set_caps (gray_caps (24, 24, "50/1"));
  ASSERT_EQ (push (1), GST_FLOW_OK);
  EXPECT_EQ (demux->info (), "") << "once";
}

TEST_F (DemuxSchedule, PropertyMakesAnUnreadableTagHarmless)
{
  start ("schedule=sequential:2x2");
  demux->push_event (gst_event_new_tag (
      gst_tag_list_new (GST_TAG_COMMENT, "coded-exposure={nonsense", nullptr)));
  EXPECT_EQ (push (0), GST_FLOW_OK);
  EXPECT_EQ (demux->error (), "");
}

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

TEST_F (DemuxSchedule, PicturesSayHowTheyWereMadeAndCodedFramesWhatTheyAre)
{
  start ("");
  demux->request ("subframe_0");
  demux->request ("coded");
  const Schedule schedule = schedule_of ("sequential:3x3");
  demux->push_event (schedule_to_event (schedule));
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

TEST_F (DemuxSchedule, MayBeRequired)
{
  start ("require-schedule=true");
  EXPECT_EQ (push (0), GST_FLOW_NOT_NEGOTIATED);
  EXPECT_NE (demux->error ().find ("schedule property"), std::string::npos);
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
  const ObjectPtr<GstBus> bus (gst_bus_new ());
  gst_element_set_bus (element.get (), bus.get ());
  g_object_set (element.get (), "schedule", "sequential:0x2", nullptr);
  EXPECT_EQ (gst_element_set_state (element.get (), GST_STATE_READY),
      GST_STATE_CHANGE_FAILURE);
  const MessagePtr message (
      gst_bus_pop_filtered (bus.get (), GST_MESSAGE_ERROR));
  ASSERT_TRUE (message);
  GError *error = nullptr;
  gst_message_parse_error (message.get (), &error, nullptr);
  EXPECT_NE (std::string (error->message).find ("0x2"), std::string::npos)
      << error->message;
  g_error_free (error);

  g_object_set (element.get (), "schedule", "", nullptr);
  EXPECT_EQ (gst_element_set_state (element.get (), GST_STATE_READY),
      GST_STATE_CHANGE_SUCCESS);
  gst_element_set_bus (element.get (), nullptr);
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

/* --------------------------------------------------------------- pixels -- */

struct PixelCase {
  const char *name;
  const char *schedule;
  const char *method;
  Method in_force;
};

class DemuxPixels : public ::testing::TestWithParam<PixelCase>
{
};

INSTANTIATE_TEST_SUITE_P (Methods, DemuxPixels,
    ::testing::Values (
        PixelCase{"one_hot", "sequential:2x2", "auto", Method::kSelect},
        PixelCase{"lattice", "sequential:lattice:4/2", "auto", Method::kSelect},
        PixelCase{"reordered", "sequential:lattice:8/3,order=bit-reversal",
            "auto", Method::kSelect},
        PixelCase{"phase", "sequential:2x2,phase=1/0", "auto", Method::kSelect},
        PixelCase{"staircase", "staircase:2x2", "auto", Method::kDecode},
        PixelCase{
            "staircase_select", "staircase:2x2", "select", Method::kSelect},
        PixelCase{"staircase_rank", "staircase:3x3", "rank", Method::kRank},
        PixelCase{"diamond", "sequential:diamond:5", "auto", Method::kSelect}),
    [] (const auto &info) { return info.param.name; });

template <typename Pixel>
void
check_pixels (const PixelCase &c, const char *format)
{
  const Image<Pixel> coded = picture<Pixel> (40, 40);
  ElementHarness demux (std::string ("codedexposure-demux schedule=\"") +
                        c.schedule + "\" method=" + c.method);
  demux.set_caps (gray_caps (40, 40, "25/1", format));
  ASSERT_EQ (demux.push (frame_of (coded, 0)), GST_FLOW_OK) << demux.error ();
  EXPECT_EQ (method_in_force (demux), int (c.in_force));
  EXPECT_EQ (
      pull_images<Pixel> (demux), expected (c.schedule, coded, c.in_force));
}

TEST_P (DemuxPixels, EqualTheExtractors)
{
  check_pixels<std::uint8_t> (GetParam (), "GRAY8");
  check_pixels<std::uint16_t> (GetParam (), "GRAY16_LE");
}

TEST (DemuxPixels, SubframeIsTheElementThatIsOpenInItsSlot)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  demux.set_caps (gray_caps (24, 24));
  const auto coded = picture ();
  ASSERT_EQ (demux.push (frame_of (coded, 0)), GST_FLOW_OK);
  const auto subframes = pull_images (demux);
  ASSERT_EQ (subframes.size (), 4u);
  for (int k = 0; k < 4; k++)
    EXPECT_EQ (subframes[std::size_t (k)],
        draw<std::uint8_t> (12, 12, [&] (int x, int y) {
          return coded.at (2 * x + k % 2, 2 * y + k / 2);
        }));
}

TEST (DemuxPixels, GainAndInterpolationReachTheDecoder)
{
  ElementHarness demux (
      "codedexposure-demux schedule=staircase:2x2 gain=1 interpolate=false");
  demux.set_caps (gray_caps (8, 8));
  /* A static scene of value 10 in each slot: elements are 10, 20, 30, 40. */
  const auto coded = draw<std::uint8_t> (
      8, 8, [] (int x, int y) { return 10 * (1 + x % 2 + 2 * (y % 2)); });
  ASSERT_EQ (demux.push (frame_of (coded, 0)), GST_FLOW_OK);
  for (const auto &subframe : pull_images (demux))
    EXPECT_EQ (
        subframe, draw<std::uint8_t> (4, 4, [] (int, int) { return 10; }));
  g_object_set (demux.element (), "gain", 3.0, nullptr);
  ASSERT_EQ (demux.push (frame_of (coded, kPeriod)), GST_FLOW_OK);
  for (const auto &subframe : pull_images (demux))
    EXPECT_EQ (
        subframe, draw<std::uint8_t> (4, 4, [] (int, int) { return 30; }));
}

/* ----------------------------------------------------------- saturation -- */

class DemuxSaturation : public DemuxSchedule
{
protected:
  /* A second without saturation ends the sequence. */
  static constexpr int kCalmFrames = int (GST_SECOND / kPeriod);

  void push_frame (int frame, int saturated)
  {
    auto image = picture ();
    for (int i = 0; i < saturated; i++)
      image.at (i, 3) = 255;
    ASSERT_EQ (demux->push (frame_of (image, GstClockTime (frame) * kPeriod)),
        GST_FLOW_OK);
  }
  std::optional<Saturated> said () { return demux->posted<Saturated> (); }
};

TEST_F (DemuxSaturation, IsSaidWhenAStretchBeginsAndEnds)
{
  start ("schedule=sequential:2x2");
  push_frame (0, 0);
  EXPECT_FALSE (said ());
  push_frame (1, 3);
  push_frame (2, 5);
  push_frame (3, 1);
  const auto begun = said ();
  ASSERT_TRUE (begun);
  EXPECT_TRUE (begun->active);
  EXPECT_EQ (begun->pixels, 3u);
  EXPECT_EQ (begun->from, kPeriod);
  EXPECT_FALSE (said ());

  for (int frame = 4; frame < 3 + kCalmFrames; frame++)
    push_frame (frame, 0);
  EXPECT_FALSE (said ());
  push_frame (3 + kCalmFrames, 0);
  const auto ended = said ();
  ASSERT_TRUE (ended);
  EXPECT_FALSE (ended->active);
  EXPECT_EQ (ended->frames, 3u);
  EXPECT_EQ (ended->pixels, 5u);
  EXPECT_EQ (ended->from, kPeriod);
  EXPECT_EQ (ended->to, 3 * kPeriod);
  EXPECT_EQ (counter_of (demux->element (), "saturated-frames"), 3u);
}

TEST_F (DemuxSaturation, IsOneStretchWhereFramesFlicker)
{
  start ("schedule=sequential:2x2");
  for (int frame = 0; frame < 4 * kCalmFrames; frame++)
    push_frame (frame, frame % kCalmFrames == 0 ? 1 : 0);
  const auto begun = said ();
  ASSERT_TRUE (begun);
  EXPECT_TRUE (begun->active);
  EXPECT_FALSE (said ());
  demux->push_event (gst_event_new_eos ());
  const auto ended = said ();
  ASSERT_TRUE (ended);
  EXPECT_EQ (ended->frames, 4u);
  EXPECT_EQ (ended->to, 3 * kCalmFrames * kPeriod);
}

TEST_F (DemuxSaturation, EosEndsAStretch)
{
  start ("schedule=sequential:2x2");
  push_frame (0, 1);
  ASSERT_TRUE (said ());
  demux->push_event (gst_event_new_eos ());
  const auto ended = said ();
  ASSERT_TRUE (ended);
  EXPECT_FALSE (ended->active);
  EXPECT_EQ (ended->frames, 1u);
}

TEST_F (DemuxSaturation, AFlushEndsAStretch)
{
  start ("schedule=sequential:2x2");
  push_frame (0, 1);
  push_frame (1, 2);
  ASSERT_TRUE (said ());
  demux->push_event (gst_event_new_flush_start ());
  demux->push_event (gst_event_new_flush_stop (TRUE));
  const auto ended = said ();
  ASSERT_TRUE (ended);
  EXPECT_FALSE (ended->active);
  EXPECT_EQ (ended->frames, 2u);
  EXPECT_EQ (ended->pixels, 2u);
  EXPECT_EQ (ended->from, 0u);
  EXPECT_EQ (ended->to, kPeriod);
}

/* A repeated frame has no information on the light. */
TEST_F (DemuxSaturation, FramesThatFillAGapDoNotCount)
{
  start ("schedule=sequential:2x2");
  push_frame (0, 1);
  auto image = picture ();
  image.at (0, 0) = 255;
  BufferPtr filler = frame_of (image, kPeriod);
  GST_BUFFER_FLAG_SET (filler.get (), GST_BUFFER_FLAG_GAP);
  ASSERT_EQ (demux->push (std::move (filler)), GST_FLOW_OK);
  demux->push_event (gst_event_new_eos ());
  ASSERT_TRUE (said ());
  const auto ended = said ();
  ASSERT_TRUE (ended);
  EXPECT_EQ (ended->frames, 1u);
  EXPECT_EQ (ended->to, 0u);
  EXPECT_EQ (counter_of (demux->element (), "saturated-frames"), 1u);
}

TEST_F (DemuxSaturation, IsCountedInTheMetaOfTheSubframes)
{
  start ("schedule=sequential:2x2");
  push_frame (0, 7);
  for (int k = 0; k < 4; k++) {
    const BufferPtr subframe = demux->pull ();
    ASSERT_TRUE (subframe);
    EXPECT_EQ (get_frame_meta (subframe.get ())->saturated, 7u);
  }
}

TEST_F (DemuxSaturation, IsJudgedByTheSignificantBits)
{
  demux = std::make_unique<ElementHarness> (
      "codedexposure-demux schedule=sequential:2x2 bits=12");
  demux->set_caps (gray_caps (24, 24, "25/1", "GRAY16_LE"));
  auto image = draw<std::uint16_t> (24, 24, [] (int, int) { return 4094; });
  ASSERT_EQ (demux->push (frame_of (image, 0)), GST_FLOW_OK);
  EXPECT_FALSE (said ());
  image.at (2, 2) = 4095;
  ASSERT_EQ (demux->push (frame_of (image, kPeriod)), GST_FLOW_OK);
  const auto begun = said ();
  ASSERT_TRUE (begun);
  EXPECT_EQ (begun->pixels, 1u);
}

TEST_F (DemuxSaturation, IsJudgedByTheBitsThatFramesSay)
{
  demux = std::make_unique<ElementHarness> (
      "codedexposure-demux schedule=sequential:2x2");
  demux->set_caps (gray_caps (24, 24, "25/1", "GRAY16_LE"));
  const auto image =
      draw<std::uint16_t> (24, 24, [] (int, int) { return 1023; });
  const int bits[] = {12, 10, 0};
  const guint64 saturated[] = {0, 24 * 24, 0};
  for (int k = 0; k < 3; k++) {
    BufferPtr frame = frame_of (image, GstClockTime (k) * kPeriod);
    set_frame_meta (frame.get (), {.frame = guint64 (k), .bits = bits[k]});
    ASSERT_EQ (demux->push (std::move (frame)), GST_FLOW_OK);
    for (int slot = 0; slot < 4; slot++)
      EXPECT_EQ (
          get_frame_meta (demux->pull ().get ())->saturated, saturated[k])
          << bits[k] << " bits";
  }
}

} // namespace
